import re

import numpy as np
from matplotlib import pyplot as plt

from armlock.rays import Crossing
from book.companion.figures import FrameSlider, glue, svg


def test_slider_shows_one_frame_and_names_each():
    labels = ["1", "2 & 3", "4"]
    slider = FrameSlider([b"<svg/>"] * 3, labels, name="s", slider="g", alt="A", start=1)
    page = slider._repr_html_()
    images = re.findall(r"<img [^>]*>", page)
    assert [" hidden" in image for image in images] == [True, False, True]
    assert 'alt="A 2 &amp; 3"' in images[1]
    assert 'aria-valuetext="2 &amp; 3"' in page
    assert "http" not in page
    assert repr(slider) == "FrameSlider('s', 3 frames)"


def test_svg_closes_its_figure():
    figure, _ = plt.subplots()
    assert b"<svg" in svg(figure)
    assert not plt.fignum_exists(figure.number)


def test_glue_names_the_parts_of_a_value(monkeypatch):
    glued: dict[str, float] = {}

    def display(record, raw, metadata):
        about = metadata["scrapbook"]
        glued[about["name"]] = float(record[about["mime_prefix"] + "text/plain"])

    monkeypatch.setattr("IPython.display.display", display)
    glue(one=np.array(4), edge=[1, 2], bar={"area": (3,)}, upper=Crossing(0.5, 2.0, 1))
    found = {"one": 4, "edge_0": 1, "edge_1": 2, "bar_area_0": 3}
    assert glued == found | {"upper_position": 0.5, "upper_omega": 2.0, "upper_change": 1}
