// From disk, a browser lets no page read another: search then lists its results without the
// lines around each of them, which it would have to read.
if (location.protocol === "file:" && typeof DOCUMENTATION_OPTIONS !== "undefined") {
  DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
}
