// The charts, and the matrix of the fraction of prey caught, in which a click on a cell plays its match.

const SERIES = { // Okabe & Ito, and brighter on dark
  light: ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#888888"],
  dark: ["#3aa5e6", "#ff7a2f", "#1fc596", "#e29cc4", "#f2b63c", "#9ad7f7", "#999999"],
};
const seriesOfTheme = () => SERIES[document.documentElement.dataset.theme] ?? SERIES.light;
// Plotly's mode bar is off, because it covers cells of the matrix and offers to upload data. A double click zooms out.
const QUIET = { displayModeBar: false, responsive: true };

// Return a figure with names of colours replaced by the colours of the page.
function coloured(figure) {
  const colour = palette(), series = seriesOfTheme();
  return JSON.parse(JSON.stringify(figure), (_, value) => {
    const name = typeof value === "string" && /^@(\w+)$/.exec(value)?.[1];
    return name ? series[name] ?? colour(name) : value;
  });
}

function layoutOf(layout) {
  const colour = palette(); // like the figures of the documents: two axes with ticks, no grid
  const axis = { showgrid: false, zeroline: false, showline: true, ticks: "outside", linecolor: colour("ink"), tickcolor: colour("ink"), automargin: true };
  return {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: colour("ink"), family: "system-ui, sans-serif", size: 12 },
    margin: { l: 48, r: 12, t: 8, b: 8 }, hovermode: "x unified", legend: { orientation: "h", y: 1.02, yanchor: "bottom" },
    hoverlabel: { bgcolor: colour("panel"), font: { color: colour("ink") } },
    ...layout, xaxis: { ...axis, ...layout.xaxis }, yaxis: { ...axis, ...layout.yaxis },
  };
}

const afterNextFrame = (work) => requestAnimationFrame(() => setTimeout(work));

// Return Plotly, which takes a second to start. It starts with the first chart, when the rest of the page is shown.
function plotly() {
  if (!window.Plotly) document.head.append(element("script", { textContent: byId("plotly").textContent }));
  return window.Plotly;
}

class Charts {
  #drawings = new Map(); // what draws each place
  #near = new IntersectionObserver((places) => {
    for (const { target, isIntersecting } of places) if (isIntersecting) afterNextFrame(() => this.#drawNow(target));
  }, { rootMargin: "50%" });

  constructor(data, player) {
    this.data = data;
    this.player = player;
    const place = document.querySelector(".charts");
    for (const { id, title, caption, click, ...chart } of data.charts) {
      place.append(element("figure", { id: `chart-${id}` }, [
        element("h3", { textContent: title }), csvButton(id, title, () => csvOfChart(chart)), element("div"),
        element("figcaption", { textContent: player && click ? `${caption} ${click}` : caption }),
      ]));
    }
    byId("matrix-figure").querySelector("figcaption").append(
      csvButton("matrix", "the matrix", () => csvOfMatrix(data.matrix, data.matrix.matrices[this.run])),
    );
    byId("charts").hidden = !data.charts.length;
    fill(byId("matrix-run"), data.runs.map((run, i) => [i, run.name, !data.matrix?.matrices[i]]));
    byId("matrix-run").addEventListener("change", () => this.#matrix());
    byId("matrix-figure").hidden = !data.matrix;
    for (const chart of data.charts) {
      const place = document.querySelector(`#chart-${chart.id} > div`);
      const entries = chart.data.filter((trace) => trace.showlegend !== false).length;
      place.style.setProperty("--entries", entries); // of its legend
      this.#drawings.set(place, () => this.#chart(place, chart));
    }
    this.#drawings.set(byId("matrix"), () => this.#matrix());
    window.addEventListener("beforeprint", () => [...this.#drawings.keys()].forEach((place) => this.#drawNow(place)));
  }

  // Draw all anew: what is near the visible part of the page soon, the rest when it comes near. A page in which all were
  // drawn at once would take half a second longer to open.
  draw() {
    this.#near.disconnect();
    for (const place of this.#drawings.keys()) this.#near.observe(place);
  }

  #drawNow(place) {
    this.#near.unobserve(place);
    this.#drawings.get(place)();
  }

  #chart(place, { id, ...figure }) {
    const { data, layout } = coloured(figure);
    plotly().react(place, data, layoutOf(layout), QUIET);
    if (id !== "master" || !this.player || place.dataset.clicks) return;
    place.dataset.clicks = "true";
    place.on("plotly_click", ({ points: [{ x, curveNumber }] }) => {
      const hunts = data[curveNumber].name.startsWith("predators");
      this.play(hunts ? { predators: x } : { prey: x });
    });
  }

  // Play champions of the run whose matrix is shown, by default those of the last generation.
  play({ predators, prey }) {
    const run = this.run;
    this.player.show({ predators: { run, generation: predators }, prey: { run, generation: prey }, start: 0 });
    bring(byId("play"));
    this.player.play();
  }

  get run() {
    const chosen = Number(byId("matrix-run").value || 0);
    return !this.player || this.player.sides[chosen] ? chosen : this.player.sides.findIndex(Boolean);
  }

  #matrix() {
    const { matrix } = this.data, place = byId("matrix"), colour = palette();
    const shown = matrix?.matrices[this.run];
    if (!shown) return;
    const [y, x] = [matrix.predators, matrix.prey];
    const heat = {
      type: "heatmap", z: shown, x, y, zmin: matrix.bottom, zmax: matrix.top, colorscale: "Viridis", colorbar: { thickness: 10, outlinewidth: 0 },
      hovertemplate: `predators of generation %{y}<br>prey of generation %{x}<br>%{z:.2f} ${matrix.words}<extra></extra>`,
    };
    const here = { ...this.#here(), mode: "markers", hoverinfo: "skip",
      marker: { symbol: "square-open", size: [14, 10], color: ["#1d2430", "#ffffff"], line: { width: 2 } }, showlegend: false };
    const ends = (axis) => [axis[0], axis.at(-1)];
    const both = { mode: "lines", x: ends(x), y: ends(y), hoverinfo: "skip", showlegend: false, line: { color: "#ffffff", width: 1, dash: "dot" } };
    const title = (text) => ({ text, font: { color: colour("muted") } });
    const layout = layoutOf({ hovermode: "closest", margin: { l: 50, r: 8, t: 6, b: 42 }, xaxis: { title: title("prey of generation") },
      yaxis: { title: title("predators of generation") } });
    plotly().react(place, x.length > 1 && y.length > 1 ? [heat, both, here] : [heat], layout, QUIET);
    if (this.player && !place.dataset.clicks) {
      place.dataset.clicks = "true";
      place.on("plotly_click", ({ points }) => {
        const cell = points.find((point) => point.curveNumber === 0);
        if (cell) this.play({ predators: cell.y, prey: cell.x });
      });
    }
  }

  // Return the cell of the current match, if it belongs to this matrix, twice: for a dark square and a white one in it.
  // One of the two is seen on any ground.
  #here() {
    const { predators, prey } = this.player ?? {}, inside = predators?.run === this.run && prey?.run === this.run;
    return { x: inside ? Array(2).fill(prey.generation) : [], y: inside ? Array(2).fill(predators.generation) : [] };
  }

  // Mark the cell of the current match.
  mark() {
    const place = byId("matrix"), { x, y } = this.#here();
    if (place.data?.length === 3) plotly().restyle(place, { x: [x], y: [y] }, [2]);
  }
}
