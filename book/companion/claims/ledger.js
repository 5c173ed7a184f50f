// Filters the rows of the ledger by verdict, section and words.
(function () {
  const form = document.querySelector('.ledger-filter');
  const rows = [...document.querySelectorAll('.ledger tbody tr')];
  const texts = rows.map(row => row.textContent.toLowerCase());
  function show() {
    const data = new FormData(form);
    const verdicts = data.getAll('verdict');
    const section = data.get('section');
    const words = data.get('words').toLowerCase().split(' ').filter(Boolean);
    let count = 0;
    rows.forEach((row, i) => {
      const hit = verdicts.includes(row.dataset.verdict)
        && (!section || row.dataset.section === section)
        && words.every(word => texts[i].includes(word));
      row.hidden = !hit;
      count += hit;
    });
    form.querySelector('output').textContent = count + ' of ' + rows.length + ' claims';
  }
  form.hidden = false;
  form.addEventListener('input', show);
  form.addEventListener('submit', event => event.preventDefault());
  form.addEventListener('reset', () => setTimeout(show));
  show();
})();
