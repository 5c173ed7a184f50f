import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from IPython.core.interactiveshell import InteractiveShell
from matplotlib.colors import to_rgba

from armlock import (
    CommonArm,
    SingleArm,
    d_curve_branches,
    d_curve_line,
    nyquist,
    paper_loop,
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
    assert chart.plot(counts=False) is ax
    (image,) = ax.images
    np.testing.assert_array_equal(~np.ma.getmaskarray(image.get_array()), chart.stable)
    assert image.cmap(0) == to_rgba(plotting.STABLE)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$c_{1}$", "$c_{2}$")


def test_large_counts_share_a_colour_and_boundary_points_have_none(ax, chart):
    chart.plot(ax, largest=5)
    shown = ax.images[0].get_array()
    assert shown.max() == 5
    np.testing.assert_array_equal(np.ma.getmaskarray(shown), chart.counts < 0)
    # Cells are centred on the points of the axes.
    assert ax.images[0].get_extent() == pytest.approx([-3.125, 3.125, -2.125, 2.125])


def test_labels_stand_in_regions_of_their_count(ax, chart):
    chart.plot(ax, labels=True)
    assert len(ax.texts) >= 2
    for text in ax.texts:
        x, y = text.get_position()
        row, column = np.abs(chart.y - y).argmin(), np.abs(chart.x - x).argmin()
        assert int(text.get_text()) == chart.counts[row, column]


def test_cells_lie_around_the_points_of_any_axes(ax):
    even, uneven = np.linspace(-1, 1, 5), np.array([0.0, 0.2, 1.0])
    stability_chart(CommonArm(), even, uneven).plot(ax)
    assert ax.images[0].get_extent() == pytest.approx((-1.25, 1.25, -0.1, 1.4))
    with pytest.raises(ValueError, match=r"^chart\.y must hold at least two values"):
        stability_chart(CommonArm(), even, [1.0]).plot(ax)
    near = 1.0 + np.linspace(-1e-9, 1e-9, 200)
    stability_chart(CommonArm(), near, near).plot(ax)


def test_d_curves_are_drawn_branch_by_branch_and_with_their_line(ax):
    branches = d_curve_branches(CommonArm(), 40.0)
    plotting.plot_branches(branches, ax, label="curve")
    plotting.plot_line(d_curve_line(CommonArm()), ax)
    *curves, line = ax.lines
    for drawn, branch in zip(curves, branches, strict=True):
        np.testing.assert_array_equal(drawn.get_xdata(), branch.x)
    assert ax.get_legend_handles_labels()[1] == ["curve"]
    for x, y in (line.get_xy1(), line.get_xy2()):
        assert x + y == pytest.approx(2.0)


def test_a_curve_has_two_halves(ax):
    curve = nyquist(CommonArm(), 0.9, 0.9, omega_max=3.0)
    curve.plot(ax, color=plotting.GREEN)
    positive, negative = ax.lines[:2]
    np.testing.assert_array_equal(positive.get_xdata(), curve.response.real)
    np.testing.assert_array_equal(negative.get_ydata(), -curve.response.imag)
    assert positive.get_color() == negative.get_color() == plotting.GREEN
    assert ax.get_legend_handles_labels()[1] == [r"$\omega > 0$", r"$\omega < 0$"]


def test_the_open_loop_goes_to_python_control_with_exact_delays():
    loop, omega = paper_loop(delay=1e-3), np.array([0.01, 0.3])
    response = loop.frequency_response(omega)
    np.testing.assert_array_equal(response(1j * omega), loop(1j * omega))
    control.bode_plot([response, SingleArm().frequency_response(omega)])
    plt.close("all")


def test_polar_axes_keep_directions_and_end_at_infinity():
    curve = nyquist(SingleArm(), 1.001, omega_max=3.0)
    figure = plt.figure()
    ax = figure.add_subplot(projection="polar")
    assert curve.plot(ax, arrows=[0.1, curve.omega[-1]]) is ax
    angle, size = np.array(ax.lines[0].get_data())
    # The first point is the one at infinity, at which the infinite branch is joined.
    assert size[0] == ax.get_ylim()[1] == plotting.INFINITY
    assert size[1:] == pytest.approx(np.minimum(abs(curve.response), plotting.INFINITY))
    assert angle[1:] == pytest.approx(np.angle(curve.response), abs=1e-12)
    branch = ax.lines[-1].get_ydata()
    assert branch == pytest.approx(plotting.INFINITY)
    assert figures.drawn(figure) == {}
    plt.close(figure)
    # Without any axes, the neighbourhood of -1 is shown.
    plt.figure()
    ax = curve.plot()
    assert ax.name == "rectilinear"
    assert ax.get_xlim() == (-3.0, 3.0)
    plt.close()


def test_a_figure_carries_its_data_and_an_svg(ax, chart):
    ax.plot([1.0, 2.0], [0.5, 0.25], label="$c_1$")
    ax.plot([1.0, 2.0], [3.0, 4.0])
    ax.axhline(7.0)
    ax.fill([0.0, 1.0, 1.0], [0.0, 0.0, 1.0], label="area")
    ax.set(xlabel=r"$\omega$ [rad/s]", ylabel="gain, $g$ [1]")
    shell = InteractiveShell()
    figures.load_ipython_extension(shell)
    carried, _ = shell.display_formatter.format(ax.figure)
    assert carried["image/svg+xml"].startswith("<?xml")
    head, *rows = carried["text/csv"].splitlines()
    assert head.startswith('"c_1, omega [rad/s]","c_1, gain, g [1]","2, gain, g [1]"')
    assert rows[0].startswith("1,0.5,3")
    assert rows[1].startswith("2,0.25,4")
    assert "7" not in rows[0] + rows[1]


def test_the_data_of_a_chart_are_its_counts_at_its_points(chart):
    ax = chart.plot(plt.figure().add_subplot(), largest=50)
    ax.figure.colorbar(ax.images[0], ax=ax)
    table = figures.drawn(ax.figure)
    x, y, colour = table.values()
    for at_x, at_y, shown in zip(x, y, colour, strict=True):
        row, column = np.abs(chart.y - at_y).argmin(), np.abs(chart.x - at_x).argmin()
        assert abs(chart.y[row] - at_y) + abs(chart.x[column] - at_x) < 1e-9
        count = chart.counts[row, column]
        assert np.isnan(shown) if count < 0 else shown == count


def test_a_long_curve_keeps_its_nulls_and_peaks(ax):
    x = np.linspace(0.0, 1.0, 50_001)
    null, peak = np.full((2, x.size), 2.0)
    null[12_345], peak[23_456], peak[:9] = 1e-3, 7.0, np.nan
    ax.plot(x, null, label="null")
    ax.plot(x, peak, label="peak")
    table = figures.drawn(ax.figure)
    assert list(table) == ["null, x", "null, y", "peak, y"]
    places, null, peak = table.values()
    assert 250 <= places.size <= 1002
    assert (places[0], places[-1]) == (0.0, 1.0)
    assert places[null.argmin()] == x[12_345]
    assert places[np.nanargmax(peak)] == x[23_456]


def test_a_drawing_has_no_data(ax):
    ax.plot([0.0, 1.0], [0.0, 1.0])
    ax.set_axis_off()
    assert figures.as_csv(ax.figure) == ""
