import matplotlib.pyplot as plt
import numpy as np
import pytest

from armlock import (
    CommonArm,
    d_curve_branches,
    d_curve_line,
    nyquist,
    plotting,
    stability_chart,
)
from book.companion import figures


@pytest.fixture
def ax():
    figure, axes = plt.subplots()
    yield axes
    plt.close(figure)


@pytest.fixture
def chart():
    return stability_chart(CommonArm(), np.linspace(-3, 3, 25), np.linspace(-2, 2, 17))


def test_the_shaded_region_is_the_stable_one(ax, chart):
    plotting.plot_stable_region(ax, chart)
    (image,) = ax.images
    np.testing.assert_array_equal(~np.ma.getmaskarray(image.get_array()), chart.stable)
    assert ax.get_xlabel() == "$c_{1}$"
    assert ax.get_ylabel() == "$c_{2}$"


def test_cells_are_centred_on_the_points_of_the_axes(ax, chart):
    plotting.plot_counts(ax, chart)
    assert ax.images[0].get_extent() == pytest.approx([-3.125, 3.125, -2.125, 2.125])


def test_large_counts_share_a_colour_and_boundary_points_have_none(ax, chart):
    plotting.plot_counts(ax, chart, largest=5)
    shown = ax.images[0].get_array()
    assert shown.max() == 5
    np.testing.assert_array_equal(np.ma.getmaskarray(shown), chart.counts < 0)


def test_no_two_branches_are_joined(ax):
    branches = d_curve_branches(CommonArm(), 40.0)
    plotting.plot_branches(ax, branches, label="curve")
    assert len(ax.lines) == len(branches) == 3
    for line, branch in zip(ax.lines, branches, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), branch.x)
    assert ax.get_legend_handles_labels()[1] == ["curve"]


def test_the_straight_line_passes_through_its_points(ax):
    plotting.plot_line(ax, d_curve_line(CommonArm()))
    (line,) = ax.lines
    for x, y in (line.get_xy1(), line.get_xy2()):
        assert x + y == pytest.approx(2.0)


def test_labels_stand_in_regions_of_their_count(ax, chart):
    plotting.label_regions(ax, chart)
    assert len(ax.texts) >= 2
    for text in ax.texts:
        x, y = text.get_position()
        row, column = np.abs(chart.y - y).argmin(), np.abs(chart.x - x).argmin()
        assert int(text.get_text()) == chart.counts[row, column]


def test_publishing_writes_figure_and_data(ax, tmp_path, monkeypatch):
    monkeypatch.setenv("ARMLOCK_FIGURES", str(tmp_path))
    links = figures.publish(ax.figure, "name", {"omega [rad/s]": [1.0, 2.0], "y": [0.5]})
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "name.csv",
        "name.png",
        "name.svg",
    ]
    assert (tmp_path / "name.csv").read_text() == "omega [rad/s],y\n1,0.5\n2,\n"
    assert "name.svg" in links._repr_html_()


def test_a_drawing_has_no_data(ax, tmp_path, monkeypatch):
    monkeypatch.setenv("ARMLOCK_FIGURES", str(tmp_path))
    assert figures.publish(ax.figure, "name", {}).files == ["name.png", "name.svg"]
    assert not (tmp_path / "name.csv").exists()


def test_publishing_without_a_folder_writes_nothing(ax, tmp_path, monkeypatch):
    monkeypatch.delenv("ARMLOCK_FIGURES", raising=False)
    monkeypatch.chdir(tmp_path)
    assert not figures.publish(ax.figure, "name", {"x": [1.0]}).files
    assert list(tmp_path.iterdir()) == []


def test_the_style_is_a_style_sheet_of_matplotlib():
    with plt.rc_context():
        plotting.use_style()
        assert plt.rcParams["savefig.dpi"] == 150


@pytest.mark.parametrize("draw", [plotting.plot_stable_region, plotting.plot_counts])
def test_charts_with_uneven_axes_are_no_pictures(ax, draw):
    even = np.linspace(-1, 1, 5)
    for bad in ([0.0, 0.1, 1.0], even[::-1], [0.5]):
        with pytest.raises(ValueError, match=r"^chart\.x must "):
            draw(ax, stability_chart(CommonArm(), bad, even))
        with pytest.raises(ValueError, match=r"^chart\.y must "):
            draw(ax, stability_chart(CommonArm(), even, bad))
    with pytest.raises(TypeError, match=r"^chart must be a StabilityChart, got array"):
        draw(ax, np.ones((3, 3)))
    assert not ax.images


def test_options_of_figures_are_checked(ax, chart):
    curve = nyquist(CommonArm(), 0.9, 0.9, omega_max=3.0)
    last = curve.omega[-1]
    for call, message in (
        (lambda: plotting.plot_counts(ax, chart, 0), "largest must be an integer from 1 on"),
        (lambda: plotting.label_regions(ax, chart, -1.0), "smallest must lie between 0 and 1"),
        (lambda: figures.chart_columns(chart, every=0), "every must be an integer from 1 on"),
        (lambda: figures.chart_columns(chart, every=-2), "every must be an integer from 1 on"),
        (lambda: plotting.plot_nyquist(ax, curve, unit=0.0), "unit must be positive"),
        (lambda: plotting.plot_nyquist(ax, curve, outer=-1.0), "outer must be positive"),
        (
            lambda: plotting.plot_nyquist(ax, curve, arrows=[last]),
            "arrows must lie above 0 and",
        ),
        (lambda: plotting.plot_nyquist(ax, curve, arrows=[np.nan]), "arrows must be finite"),
        (lambda: figures.publish(ax.figure, "a/b", {}), "name must be the stem of a file"),
        (lambda: figures.publish(ax.figure, "", {}), "name must be the stem of a file"),
    ):
        with pytest.raises(ValueError, match=f"^{message}"):
            call()
    with pytest.raises(TypeError, match=r"^curve must be a NyquistCurve, got CommonArm"):
        plotting.plot_nyquist(ax, CommonArm())  # type: ignore[arg-type]
    assert not ax.lines
    plotting.plot_nyquist(ax, curve, arrows=[curve.omega[-2]])
