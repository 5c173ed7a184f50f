import matplotlib.pyplot as plt
import pytest

from book.companion import diagrams


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (diagrams.plot_modules, {"local spacecraft", "laser", "optical bench"}),
        (diagrams.plot_loop, {"$K(s)$", "$m_1(s)$", "$m_2(s)$", "$c_1$", "$c_2$"}),
    ],
)
def test_a_diagram_names_its_parts_within_the_axes(draw, words):
    figure, ax = plt.subplots()
    draw(ax)
    figure.canvas.draw()
    assert words <= {text.get_text() for text in ax.texts}
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for text in ax.texts:
        x, y = text.get_position()
        assert left <= x <= right
        assert low <= y <= high
    plt.close(figure)
