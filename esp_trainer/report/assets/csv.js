// Downloads of what charts show, as CSV.

const cellOfCsv = (value) => (value === null || value === undefined ? "" : /[",\n]/.test(value) ? `"${String(value).replaceAll('"', '""')}"` : String(value));
const asCsv = (rows) => `${rows.map((row) => row.map(cellOfCsv).join(",")).join("\n")}\n`;

// Return the columns of a chart, { name: Map of generation to value }. A band gives its upper and lower edge.
function columnsOf(traces) {
  const columns = {};
  for (const { type, x, y, name, legendgroup, customdata, fill: filled } of traces) {
    const label = name ?? legendgroup, half = x.length / 2;
    if (type === "heatmap") { // the founder of each neuron
      y.forEach((row, i) => { columns[`neuron ${row}`] = new Map(x.map((at, j) => [at, customdata[i][j][0]])); });
    } else if (filled === "toself") {
      columns[`${label}, high`] = new Map(range(half).map((i) => [x[i], y[i]]));
      columns[`${label}, low`] = new Map(range(half).map((i) => [x[half + i], y[half + i]]));
    } else {
      columns[label] = new Map(x.map((at, i) => [at, y[i]]));
    }
  }
  return columns;
}

// Return a chart by generations as CSV: a row for each generation, a column for each curve.
function csvOfChart({ data }) {
  const columns = columnsOf(data), at = new Set(Object.values(columns).flatMap((column) => [...column.keys()]));
  const rows = [...at].sort((a, b) => a - b).map((each) => [each, ...Object.values(columns).map((column) => column.get(each))]);
  return asCsv([["generation", ...Object.keys(columns)], ...rows]);
}

// Return a matrix as CSV: a row for each pair of generations.
function csvOfMatrix({ predators, prey, name }, payoffs) {
  const rows = predators.flatMap((p, i) => prey.map((q, j) => [p, q, payoffs[i][j]]));
  return asCsv([["predators of generation", "prey of generation", name], ...rows]);
}

// Return a button that downloads a text, which make() returns, as a file.
function csvButton(name, what, make) {
  return buttonOf("CSV", () => {
    const link = element("a", { download: `${name}.csv`, href: URL.createObjectURL(new Blob([make()], { type: "text/csv" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }, { className: "csv", ariaLabel: `download ${what} as CSV` });
}
