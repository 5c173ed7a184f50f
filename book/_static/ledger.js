// Filters and sorts the rows of the ledger, and unfolds the one that a link leads to.
(function () {
  const form = document.querySelector('.ledger-filter');
  const body = document.querySelector('.ledger tbody');
  const rows = [...body.rows];
  const texts = rows.map(row => row.textContent.toLowerCase());
  function show() {
    const data = new FormData(form);
    const section = data.get('section');
    const words = data.get('words').toLowerCase().split(' ').filter(Boolean);
    let count = 0;
    rows.forEach((row, i) => {
      const hit = data.getAll('verdict').includes(row.dataset.verdict)
        && data.getAll('weight').includes(row.dataset.weight)
        && (!section || row.dataset.section === section)
        && (!data.has('major') || row.dataset.major === '1')
        && words.every(word => texts[i].includes(word));
      row.hidden = !hit;
      count += hit;
    });
    form.querySelector('output').textContent = count + ' of ' + rows.length + ' claims';
  }
  // The order of each column: claims as in the paper, verdicts and weights as in the form.
  const place = name => row =>
    [...form.elements[name]].findIndex(box => box.value === row.dataset[name]);
  const orders = [() => 0, place('verdict'), place('weight')];
  const heads = [...document.querySelectorAll('.ledger thead th')];
  orders.forEach((key, column) => {
    const button = document.createElement('button');
    button.type = 'button';
    button.textContent = heads[column].textContent;
    button.title = 'Sort by this';
    heads[column].replaceChildren(button);
    button.addEventListener('click', () => {
      heads.forEach(head => head.removeAttribute('aria-sort'));
      heads[column].setAttribute('aria-sort', 'ascending');
      body.append(...[...rows].sort((a, b) => key(a) - key(b)));
    });
  });
  function unfold() {
    const row = document.getElementById(location.hash.slice(1))?.closest('table.claims tbody tr');
    if (!row) return;
    form.reset();
    row.hidden = false;
    row.querySelector('details').open = true;
    row.scrollIntoView();
  }
  form.hidden = false;
  form.addEventListener('input', show);
  form.addEventListener('submit', event => event.preventDefault());
  form.addEventListener('reset', () => setTimeout(show));
  addEventListener('hashchange', unfold);
  show();
  unfold();
})();
