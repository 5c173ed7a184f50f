import re

from book.companion.figures import FrameSlider


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
