// A picture of what a network wants: the move with the most votes, by where another agent stands around its own.

const SAMPLES = 25; // positions along each axis, evenly spaced over the torus
const ARROWS = { east: "→", west: "←", north: "↑", south: "↓", idle: "•" };

class Wants {
  // nameOf: returns the name of an agent.
  constructor(game, moves, nameOf) {
    Object.assign(this, { game, moves, nameOf });
    this.canvas = element("canvas", { role: "img" });
    this.says = element("figcaption");
    this.place = element("figure", { className: "wants" }, [this.canvas, this.says]);
    new IntersectionObserver(() => this.asked && this.show(...this.asked)).observe(this.place);
  }

  // Show a network of an agent by its number, or the sum of all votes if there is no network of that number.
  show(match, step, agent, network) {
    const about = this.#about(match, step, agent, network);
    this.asked = [match, step, agent, network];
    this.place.hidden = !about;
    const key = JSON.stringify([about, agent, network, step, document.documentElement.dataset.theme]);
    if (!about || (match === this.match && key === this.key) || !inView(this.place)) return; // out of sight it costs nothing
    Object.assign(this, { match, key });
    const { size } = this.game.rules, along = range(SAMPLES).map((i) => Math.round(((i + 0.5) / SAMPLES - 0.5) * (size - 1)));
    const offsets = along.flatMap((dy) => along.map((dx) => [dx, dy]));
    const votes = this.game.thoughtsIf(match, step, agent, about.other, offsets).map((thoughts) => (
      thoughts.networks[network]?.outputs ?? thoughts.votes));
    this.#paint(votes, this.#offset(match.cells[step], agent, about.other));
    const whose = about.sum ? `all networks of ${this.nameOf(agent)} together` : `network ${network + 1} of ${this.nameOf(agent)}`;
    this.says.textContent = `What ${whose} would vote for, by where ${this.nameOf(about.other)} stands around ${this.nameOf(agent)} ` +
      `(in the middle; ${size} cells across). All others stay where they are. The ring: where ${this.nameOf(about.other)} is now.`;
    this.canvas.ariaLabel = this.says.textContent;
  }

  // Return whose place is varied, the first whom the network reads; null if there is nothing to show.
  #about(match, step, agent, network) {
    const { n_predators, n_prey } = this.game.rules, hunts = agent < n_predators;
    const { scripted, controller } = hunts ? match.predators : match.prey;
    const caught = (each) => each >= n_predators && match.caughtAt[each - n_predators] <= step;
    if (scripted || step >= match.length || agent === match.steered || caught(agent)) return null;
    const read = controller.wiring[network]?.[0] ?? 0, n_opponents = hunts ? n_prey : n_predators;
    const opponent = controller.n_together > 1 ? 0 : Math.min(Math.floor(read / 2), n_opponents - 1);
    const other = hunts ? n_predators + opponent : opponent;
    return caught(other) ? null : { other, sum: network >= controller.wiring.length };
  }

  #offset(cells, agent, other) {
    return [0, 1].map((axis) => displacement(cells[agent][axis], cells[other][axis], this.game.rules.size));
  }

  #paint(votes, now) {
    const { canvas, moves } = this, side = Math.round((canvas.clientWidth || 260) * (window.devicePixelRatio || 1));
    canvas.width = canvas.height = side;
    const pen = canvas.getContext("2d"), colour = palette(), cell = side / SAMPLES, { size } = this.game.rules;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.font = `${1.9 * cell}px system-ui, sans-serif`;
    const best = votes.map((outputs) => outputs.indexOf(Math.max(...outputs)));
    const corner = (i) => [(i % SAMPLES) * cell, side - (Math.floor(i / SAMPLES) + 1) * cell];
    best.forEach((action, i) => {
      pen.fillStyle = mix(seriesOfTheme()[action], colour("panel"), 0.55);
      pen.fillRect(...corner(i), Math.ceil(cell), Math.ceil(cell));
    });
    pen.fillStyle = colour("ink");
    best.forEach((action, i) => {
      if (i % SAMPLES % 3 !== 1 || Math.floor(i / SAMPLES) % 3 !== 1) return;
      const [x, y] = corner(i);
      pen.fillText(ARROWS[moves[action]], x + cell / 2, y + cell / 2);
    });
    const at = now.map((part) => (part / size + 0.5) * side), ring = (x, y, radius, width) => {
      pen.lineWidth = width;
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.stroke();
    };
    pen.strokeStyle = colour("ink");
    ring(side / 2, side / 2, 2, 4);
    ring(at[0], side - at[1], cell, cell / 3);
  }
}
