// Drawing of a match at one time on a canvas. The torus has no edge, so everything near an edge is drawn at both edges,
// and no line is drawn across the world.

const LETTERS = "abcdefghijklmnopqrstuvwyz"; // without x, which marks a caught prey
const RING = 12; // number of steps for which the ring of a capture grows

// Return a function that looks up colours of the page by name, for example colour("predators").
function palette() {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}

// Return the colour #rrggbb blended over a ground, with the given opacity (share).
function mix(colour, ground, share) {
  const parts = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
  const [over, under] = [parts(colour), parts(ground)];
  return `rgb(${over.map((part, i) => Math.round(under[i] + (part - under[i]) * share)).join(" ")})`;
}

class Painter {
  constructor(canvas, env) {
    this.canvas = canvas;
    this.env = env;
  }

  // Draw the match at a time in steps, which need not be whole. trail: number of steps of the trails. cells: side of the
  // visible part of the world. about: cell at its centre.
  paint({ match, episode, role }, time, { trail = 40, chosen = -1, cells = this.env.size, about = [0, 0] } = {}) {
    const { canvas, env } = this, paths = episode.cells, side = Math.round(canvas.clientWidth * (window.devicePixelRatio || 1));
    if (!side) return;
    if (canvas.width !== side) canvas.width = canvas.height = side;
    const origin = cells < env.size ? about.map((at) => Math.floor(at - cells / 2)) : [0, 0];
    Object.assign(this, { pen: canvas.getContext("2d"), colour: palette(), side, scale: side / cells, origin });
    const now = Math.min(Math.floor(time), match.length), share = now < match.length ? time - now : 0;
    this.radius = Math.max(side / 52, 0.45 * this.scale);
    this.#ground();
    const where = (agent) => {
      const from = paths[now][agent], to = paths[Math.min(now + 1, match.length)][agent];
      return [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
    };
    const agents = range(env.n_predators + env.n_prey), free = (agent) => match.caughtAt[agent - env.n_predators] > time;
    for (const agent of agents) this.#trail(paths, agent, now, where(agent), trail, agent < env.n_predators || free(agent));
    const prey = agents.slice(env.n_predators);
    for (const agent of prey.filter((each) => !free(each))) {
      this.#prey(where(agent), agent - env.n_predators, false, time - match.caughtAt[agent - env.n_predators]);
    }
    for (const agent of agents.slice(0, env.n_predators).reverse()) {
      const heading = minus(paths[Math.min(now + 1, match.length)][agent], paths[now][agent]);
      this.#predator(where(agent), agent, heading, role[now][agent], agent === chosen);
    }
    for (const agent of prey.filter(free)) this.#prey(where(agent), agent - env.n_predators, true, 0, agent === chosen);
  }

  // Return the cell at a point of the canvas, in CSS pixels from its corner.
  cellAt(x, y) {
    const { size } = this.env, cell = (part) => Math.max(0, Math.min(size - 1, Math.floor(part * size)));
    return [cell(x / this.canvas.clientWidth), cell(1 - y / this.canvas.clientHeight)];
  }

  #ground() {
    const { pen, side, scale, env, colour } = this;
    pen.fillStyle = colour("panel");
    pen.fillRect(0, 0, side, side);
    pen.strokeStyle = colour("grid");
    pen.lineWidth = 1;
    const spacing = [1, 10, 100, 1000, 10000].find((cells) => cells * scale >= side / 25);
    pen.beginPath();
    const first = this.origin.map((at) => spacing * Math.ceil(at / spacing) - at);
    for (let line = 0; line <= env.size; line += spacing) {
      const [x, y] = first.map((from) => Math.round((from + line) * scale) + 0.5);
      pen.moveTo(x, 0); pen.lineTo(x, side);
      pen.moveTo(0, side - y); pen.lineTo(side, side - y);
    }
    pen.stroke();
  }

  // Call draw for each visible copy of an unwrapped cell, including copies up to a margin (in pixels) outside.
  #copies([x, y], margin, draw) {
    const { size } = this.env, { side, scale, origin } = this, round = size * scale;
    const along = (at, axis) => ((((at + 0.5 - origin[axis]) % size) + size) % size) * scale;
    const px = along(x, 0), py = side - along(y, 1);
    for (const dx of [-round, 0, round]) {
      for (const dy of [-round, 0, round]) {
        const inside = (at) => at > -margin && at < side + margin;
        if (inside(px + dx) && inside(py + dy)) draw(px + dx, py + dy);
      }
    }
  }

  #trail(paths, agent, now, place, length, lively) {
    const { pen, scale, env, colour } = this, first = Math.max(0, now - length);
    const own = colour(agent < env.n_predators ? "predators" : lively ? "prey" : "caught"), ground = colour("panel");
    pen.lineCap = "round";
    for (let t = first; t <= now; t++) {
      const from = paths[t][agent], to = t < now ? paths[t + 1][agent] : place, fresh = 1 - (now - t) / (length + 1);
      if (from[0] === to[0] && from[1] === to[1]) continue;
      pen.strokeStyle = mix(own, ground, 0.15 + 0.6 * fresh); // opaque, because pieces overlap
      pen.lineWidth = this.radius * (0.15 + 0.3 * fresh);
      this.#copies(from, 2 * scale + 2, (x, y) => {
        pen.beginPath();
        pen.moveTo(x, y);
        pen.lineTo(x + (to[0] - from[0]) * scale, y - (to[1] - from[1]) * scale);
        pen.stroke();
      });
    }
  }

  #predator(place, number, heading, role, chosen) {
    const { pen, radius, colour } = this, fill = colour(["predators", "blocker", "attacker"][role]);
    this.#copies(place, 3 * radius, (x, y) => {
      pen.fillStyle = fill;
      pen.strokeStyle = colour("panel");
      pen.lineWidth = radius / 6;
      if (heading[0] || heading[1]) {
        const [ex, ey] = [heading[0], -heading[1]];
        pen.beginPath();
        pen.moveTo(x + 1.6 * radius * ex, y + 1.6 * radius * ey);
        pen.lineTo(x + 0.75 * radius * ex - 0.7 * radius * ey, y + 0.75 * radius * ey + 0.7 * radius * ex);
        pen.lineTo(x + 0.75 * radius * ex + 0.7 * radius * ey, y + 0.75 * radius * ey - 0.7 * radius * ex);
        pen.fill();
      }
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
      this.#label(String(number), x, y);
      if (chosen) this.#halo(x, y);
    });
  }

  #prey(place, number, alive, since, chosen) {
    const { pen, radius, colour } = this, half = 0.8 * radius;
    this.#copies(place, 4 * radius, (x, y) => {
      if (!alive && since < RING) {
        pen.globalAlpha = 1 - since / RING;
        pen.strokeStyle = colour("mark");
        pen.lineWidth = radius / 5;
        pen.beginPath();
        pen.arc(x, y, radius * (1.6 + (1.6 * since) / RING), 0, 2 * Math.PI);
        pen.stroke();
        pen.globalAlpha = 1;
      }
      pen.fillStyle = colour(alive ? "prey" : "caught");
      pen.strokeStyle = colour("panel");
      pen.lineWidth = radius / 6;
      pen.fillRect(x - half, y - half, 2 * half, 2 * half);
      pen.strokeRect(x - half, y - half, 2 * half, 2 * half);
      this.#label(alive ? LETTERS[number % LETTERS.length] : "×", x, y);
      if (chosen) this.#halo(x, y);
    });
  }

  #label(text, x, y) {
    const { pen, radius, colour } = this;
    if (radius < 7) return;
    pen.fillStyle = colour("panel");
    pen.font = `600 ${1.35 * radius}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(text, x, y + radius * 0.06);
  }

  #halo(x, y) {
    const { pen, radius, colour } = this;
    pen.strokeStyle = colour("ink");
    pen.lineWidth = radius / 6;
    pen.beginPath();
    pen.arc(x, y, 1.35 * radius, 0, 2 * Math.PI);
    pen.stroke();
  }
}
