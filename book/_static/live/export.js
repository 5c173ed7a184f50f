"use strict";
/*
 * Pictures as one file, 1600 pixels wide, with what they are of: the controller, the numbers, and the pinned loop.
 */
const armlockExport = (function () {
  const { element, palette } = armlockDraw;
  const WIDE = 1600, SCALE = 2, EDGE = 12;

  /* A text in lines that are as wide as there is room, in the pen's font. */
  function wrapped(pen, text, room) {
    const lines = [""];
    for (const word of text.split(" ")) {
      const longer = lines.at(-1) ? `${lines.at(-1)} ${word}` : word;
      if (pen.measureText(longer).width > room && lines.at(-1)) lines.push(word); else lines[lines.length - 1] = longer;
    }
    return lines;
  }

  /* `lines` stand below the pictures, and below them the rows of a table. */
  function snapshot(sheets, lines, table, done) {
    const colours = palette(), width = WIDE / SCALE, columns = sheets.length > 1 ? 2 : 1, room = (width - EDGE * (columns + 1)) / columns;
    const all = element("canvas"), pen = all.getContext("2d"), fonts = ["13px sans-serif", "bold 13px sans-serif"];
    pen.font = fonts[0];
    // Where each picture is, two in a row.
    const places = [];
    let down = EDGE;
    for (let k = 0; k < sheets.length; k += columns) {
      const row = sheets.slice(k, k + columns).map((sheet, i) => ({ sheet, x: EDGE + i * (room + EDGE), scale: room / sheet.wide,
        caption: wrapped(pen, sheet.canvas.parentElement.querySelector("figcaption").textContent, room) }));
      const above = 17 * Math.max(...row.map(({ caption }) => caption.length)) + 4;
      places.push(...row.map(one => ({ ...one, y: down, above })));
      down += above + Math.max(...row.map(({ sheet, scale }) => sheet.high * scale)) + EDGE;
    }
    const rows = Array.from(table?.rows || [], row => Array.from(row.cells, cell => ({ text: cell.textContent, head: cell.tagName === "TH" && row.cells.length === 1 || row.parentElement.tagName === "THEAD" })));
    const words = lines.flatMap(line => wrapped(pen, line, width - 2 * EDGE)), cells = Math.max(1, ...rows.map(row => row.length - 1));
    Object.assign(all, { width: WIDE, height: Math.round(SCALE * (down + 18 * (words.length + rows.length) + 2 * EDGE)) });
    pen.scale(SCALE, SCALE);
    pen.fillStyle = colours.ground;
    pen.fillRect(0, 0, width, all.height);
    pen.fillStyle = colours.text;
    for (const { sheet, x, y, above, scale, caption } of places) {
      pen.font = fonts[0];
      caption.forEach((line, k) => pen.fillText(line, x, y + 13 + 17 * k));
      const copy = element("canvas");
      sheet.render(copy, SCALE * scale);
      pen.drawImage(copy, x, y + above, sheet.wide * scale, sheet.high * scale);
    }
    for (const line of words) pen.fillText(line, EDGE, down += 18);
    down += EDGE / 2;
    for (const row of rows) {
      down += 18;
      row.forEach(({ text, head }, k) => {
        pen.font = fonts[head ? 1 : 0];
        pen.textAlign = k ? "right" : "left";
        const share = (width - 2 * EDGE - 230) / cells;
        pen.fillText(text, k ? width - EDGE - share * (cells - k) : EDGE, down, k ? share - EDGE : width);
      });
    }
    all.toBlob(done);
  }

  return { snapshot };
})();
