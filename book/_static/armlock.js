// From disk, a browser lets no page read another: search then lists its results without the
// lines around each of them, which it would have to read.
if (location.protocol === "file:" && typeof DOCUMENTATION_OPTIONS !== "undefined") {
  DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
}

// Code, tables and formulas that are wider than the text can be scrolled, with the keys as well,
// and fade at the right as long as there is more.
const WIDE = ".bd-article :is(pre, div.math, .text_html, .pst-scrollable-table-container)";
const look = part => {
  const cut = part.scrollWidth > part.clientWidth + 1;
  const more = part.scrollWidth - part.clientWidth - part.scrollLeft > 1;
  part.toggleAttribute("data-more", cut && more);
  if (cut) part.tabIndex = 0;
};
addEventListener("load", () => {
  const sizes = new ResizeObserver(entries => entries.forEach(entry => look(
    entry.target.matches(WIDE) ? entry.target : entry.target.parentElement)));
  for (const part of document.querySelectorAll(WIDE)) {
    part.addEventListener("scroll", () => look(part), {passive: true});
    for (const one of [part, ...part.children]) sizes.observe(one);
  }
});

// In a line of text, a formula stays with the comma behind it and the bracket before it. One that
// is wider than the line, on a telephone, scrolls.
addEventListener("load", async () => {
  await window.MathJax?.startup?.promise;
  const formulas = [...document.querySelectorAll(".bd-article mjx-container:not([display])")];
  for (const formula of formulas) {
    const part = formula.closest("span.math") ?? formula;
    const before = /\S*[([“]$/.exec(part.previousSibling?.data ?? "");
    const after = /^[.,;:)\]”?]+/.exec(part.nextSibling?.data ?? "")?.[0] ?? "";
    if (!before && !after) continue;
    const whole = document.createElement("span");
    whole.className = "unbroken";
    part.before(whole);
    whole.append(part, after);
    if (before) whole.prepend(whole.previousSibling.splitText(before.index));
    if (after) whole.nextSibling.deleteData(0, after.length);
  }
  // What is inline has no width of its own here.
  const room = element => element.clientWidth || room(element.parentElement);
  for (const formula of formulas.filter(one => one.offsetWidth > room(one.parentElement))) {
    formula.classList.add("wide");
    formula.addEventListener("scroll", () => look(formula), {passive: true});
    look(formula);
  }
});

// A link to a cell whose code is folded unfolds it.
const unfold = () => {
  const cell = document.getElementById(location.hash.slice(1))?.closest(".cell");
  for (const part of cell?.querySelectorAll("details.hide") ?? []) part.open = true;
  cell?.scrollIntoView();
};
addEventListener("load", unfold);
addEventListener("hashchange", unfold);

// What the theme and docutils leave unnamed for a screen reader, or call by a role that is gone.
addEventListener("DOMContentLoaded", () => {
  const set = (selector, name, value) => document.querySelectorAll(selector).forEach(
    element => value ? element.setAttribute(name, value) : element.removeAttribute(name));
  set("summary:has(.toctree-toggle)", "aria-label", "Unfold the pages of this part");
  set("#pst-primary-sidebar", "role", "complementary");
  set("#pst-primary-sidebar", "aria-label", "The book");
  set(".citation-list, .citation", "role");
  // Their own words say more than the names that they are given.
  set("details.hide summary, .search-button-field", "aria-label");
  for (const corner of document.querySelectorAll("th.head"))
    if (!corner.textContent.trim()) corner.outerHTML = "<td></td>";
});
