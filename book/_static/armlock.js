// From disk, a browser lets no page read another: search then lists its results without the
// lines around each of them, which it would have to read.
if (location.protocol === "file:" && typeof DOCUMENTATION_OPTIONS !== "undefined") {
  DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
}

// Code, tables and formulas that are wider than the text can be scrolled, with the keys as well,
// and fade at the right as long as there is more.
const WIDE = ".bd-article :is(pre, div.math, .text_html, .pst-scrollable-table-container)";
addEventListener("load", () => {
  const look = part => {
    const cut = part.scrollWidth > part.clientWidth + 1;
    const more = part.scrollWidth - part.clientWidth - part.scrollLeft > 1;
    part.toggleAttribute("data-more", cut && more);
    if (cut) part.tabIndex = 0;
  };
  const sizes = new ResizeObserver(entries => entries.forEach(entry => look(
    entry.target.matches(WIDE) ? entry.target : entry.target.parentElement)));
  for (const part of document.querySelectorAll(WIDE)) {
    part.addEventListener("scroll", () => look(part), {passive: true});
    for (const one of [part, ...part.children]) sizes.observe(one);
  }
});

// What the theme and docutils leave unnamed for a screen reader, or call by a role that is gone.
addEventListener("DOMContentLoaded", () => {
  const set = (selector, name, value) => document.querySelectorAll(selector).forEach(
    element => value ? element.setAttribute(name, value) : element.removeAttribute(name));
  set("summary:has(.toctree-toggle)", "aria-label", "Unfold the pages of this part");
  set("#pst-primary-sidebar", "role", "complementary");
  set("#pst-primary-sidebar", "aria-label", "The book");
  set(".citation-list, .citation", "role");
  for (const corner of document.querySelectorAll("th.head"))
    if (!corner.textContent.trim()) corner.outerHTML = "<td></td>";
});
