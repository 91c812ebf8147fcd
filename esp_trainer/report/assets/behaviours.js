// The detectors of esp_trainer/analysis/behaviours for one match, row by row. The Python code defines them over arrays
// of episodes, with quotations from the paper and reasons. A test checks that both give the same results.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1];
const cross = (a, b) => a[0] * b[1] - a[1] * b[0];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];
const span = (a) => Math.abs(a[0]) + Math.abs(a[1]);
const cosine = (a, b) => {
  const lengths = Math.sqrt(dot(a, a) * dot(b, b));
  return lengths > 0 ? dot(a, b) / Math.max(lengths, 1) : 1;
};
const range = (n) => Array.from({ length: n }, (_, i) => i);

// The unwrapped paths of a match. Rows after its end repeat the last row.
class Paths {
  constructor(match, { n_predators, n_prey, size, max_cycles }) {
    Object.assign(this, { size, length: match.length, rows: max_cycles + 1 });
    this.hunters = range(n_predators);
    this.hunted = range(n_prey);
    const cells = [match.cells[0].map((cell) => [...cell])];
    for (let t = 1; t < this.rows; t++) {
      const last = cells[t - 1];
      cells.push(t > match.length ? last : match.cells[t].map((cell, i) => {
        const step = this.shortest(minus(cell, match.cells[t - 1][i]));
        return [last[i][0] + step[0], last[i][1] + step[1]];
      }));
    }
    this.cells = cells;
    this.n_predators = n_predators;
    this.capturedAt = this.hunted.map((j) => this.#captured(j, match.caughtAt[j]));
  }

  // A free prey always moves, so a prey that stands still was caught when it reached its cell.
  #captured(j, caughtAt) {
    for (let t = 0; t < this.length; t++) if (!span(minus(this.prey(t + 1, j), this.prey(t, j)))) return t;
    return caughtAt === Infinity ? this.rows : this.length;
  }

  shortest(way) {
    const half = Math.floor(this.size / 2), wrapped = (a) => ((((a + half) % this.size) + this.size) % this.size) - half;
    return [wrapped(way[0]), wrapped(way[1])];
  }

  at(t, agent) { return this.cells[(t + this.rows) % this.rows][agent]; }
  predator(t, i) { return this.at(t, i); }
  prey(t, j) { return this.at(t, this.n_predators + j); }
  step(t, agent) { return t === 0 ? [0, 0] : minus(this.at(t, agent), this.at(t - 1, agent)); }
  offset(t, i, j) { return this.shortest(minus(this.predator(t, i), this.prey(t, j))); }
  distance(t, i, j) { return span(this.offset(t, i, j)); }
  between(t, one, other) { return this.shortest(minus(this.prey(t, other), this.prey(t, one))); }
  reaches(t, back, on) { return t >= back && t + on <= this.length; }
  alive(t, j) { return t >= 0 && t <= this.length && t < this.capturedAt[j]; }
  free(t, j, back, on) { return this.reaches(t, back, on) && this.alive(t + on, j); }
  hunted_before(t, j, rows) { return this.reaches(t, rows, 0) && this.alive(t - 1, j); }

  // Return the longer side of the box that holds a path over row t and the rows before it.
  extent(t, agent, rows) {
    const lately = range(rows + 1).map((back) => this.at(t - back, agent));
    return Math.max(...[0, 1].map((axis) => {
      const along = lately.map((cell) => cell[axis]);
      return Math.max(...along) - Math.min(...along);
    }));
  }

  // Return in how many of the last rows up to t a condition holds.
  count(t, rows, holds) {
    let found = 0;
    for (let s = Math.max(0, t - rows + 1); s <= t; s++) found += Number(holds(s));
    return found;
  }

  turned(t, agent) {
    const step = this.step(t, agent), before = this.step(t - 1, agent);
    return step[0] !== before[0] || step[1] !== before[1];
  }

  // Return whether a predator's step to row t led towards the cell in which the prey was before it.
  towards(t, i, j) { return t > 0 && dot(this.step(t, i), this.offset(t - 1, i, j)) < 0; }

  // Return the direction of a prey's last steps if all went the same way, else 0.
  running(t, j, run) {
    const agent = this.n_predators + j;
    const straight = this.reaches(t, run, 0) && !this.count(t, run - 1, (s) => this.turned(s, agent));
    return straight ? this.step(t, agent) : [0, 0];
  }

  inTheWay(t, i, j, run, path, lane) {
    const direction = this.running(t, j, run), offset = this.offset(t, i, j), forward = dot(offset, direction);
    return forward > 0 && forward <= path && Math.abs(cross(offset, direction)) <= lane;
  }
}

// Return which predators attack and which block which prey at which rows, as booleans [predator][prey][row].
function rolesOf(paths, x) {
  const spread = (found, rows) => range(paths.rows).map((t) => range(rows + 1).some((on) => found(t + on)));
  const within = (test) => {
    const rows = range(paths.rows).map(test);
    return (t) => Boolean(rows[t]);
  };
  const each = (rule) => paths.hunters.map((i) => paths.hunted.map((j) => rule(i, j)));
  const attacks = each((i, j) => spread(within((t) => {
    const near = (s) => paths.distance(s, i, j) <= x.near;
    if (!near(t) || !paths.hunted_before(t, j, x.chase)) return false;
    if (paths.count(t, x.chase, (s) => paths.towards(s, i, j)) < x.chase - x.slips) return false;
    return paths.count(t, x.chase - 1, (s) => paths.turned(s, i)) > 0
      || paths.count(t, x.chase + 1, near) > x.chase
      || paths.count(t, x.chase, (s) => cross(paths.step(s, i), paths.offset(s - 1, i, j)) === 0) === x.chase;
  }), x.chase));
  const blocks = each((i, j) => spread(within((t) => paths.hunted_before(t, j, x.post)
    && paths.inTheWay(t, i, j, x.run, x.path, x.lane)
    && paths.extent(t, i, x.post) <= x.area), x.post));
  return { attacks, blocks };
}

const RULES = {
  attacker: (p, x, t, { attacks }) => attacks.some((of) => of.some((rows) => rows[t])),

  blocker: (p, x, t, { blocks }) => blocks.some((of) => of.some((rows) => rows[t])),

  "role switch": (p, x, t, { attacks, blocks }) => p.hunters.some((i) => p.hunted.some((j) => {
    const role = (s) => (attacks[i][j][s] ? 2 : blocks[i][j][s] ? 1 : 0);
    if (t === 0 || !role(t)) return false;
    let s = t - 1;
    while (s > 0 && !role(s)) s--;
    return role(s) > 0 && role(s) !== role(t);
  })),

  "opposing attack": (p, x, t, { attacks }) => pairs(p.hunters).some(([i, k]) => p.hunted.some((j) => {
    const ready = (a) => attacks[a][j][t] && p.distance(t, a, j) <= x.near;
    return p.alive(t, j) && ready(i) && ready(k)
      && cosine(p.offset(t, i, j), p.offset(t, k, j)) <= -Math.sqrt(0.5) + 1e-9;
  })),

  encirclement: (p, x, t) => p.reaches(t, x.wait, 0) && p.hunted.some((j) => {
    const near = p.hunters.filter((i) => p.distance(t, i, j) <= x.near);
    const closer = near.reduce((sum, i) => sum + p.distance(t - x.wait, i, j) - p.distance(t, i, j), 0);
    if (near.length < 3 || closer < x.approach * near.length || !p.alive(t, j)) return false;
    const angles = near.map((i) => Math.atan2(...p.offset(t, i, j).reverse())).sort((a, b) => a - b);
    const gaps = angles.map((angle, k) => (k + 1 < angles.length ? angles[k + 1] : angles[0] + 2 * Math.PI) - angle);
    return Math.max(...gaps) < Math.PI - 1e-9;
  }),

  circling: (p, x, t) => p.hunted.some((j) => p.alive(t, j) && lengthsOfCircles(x).some((length) => {
    const agent = p.n_predators + j;
    if (!p.reaches(t, length + 1, 0) || span(minus(p.prey(t, j), p.prey(t - length, j))) > 2) return false;
    const turns = range(length).reduce((sum, back) => sum + cross(p.step(t - back - 1, agent), p.step(t - back, agent)), 0);
    return Math.abs(turns) >= 4 && p.hunters.some((i) => p.count(t, length + 1, (s) => p.distance(s, i, j) <= x.tail) > length
      && 4 * p.count(t, length, (s) => p.towards(s, i, j)) >= 3 * length);
  })),

  baiting: (p, x, t) => p.hunted.some((j) => {
    const way = minus(p.prey(t + x.escape, j), p.prey(t, j));
    if (!p.free(t, j, x.wait, x.escape) || span(way) < 0.8 * x.escape) return false;
    if (p.extent(t, p.n_predators + j, x.wait) > x.pause) return false;
    const baited = p.hunters.filter((i) => p.distance(t - x.wait, i, j) - p.distance(t, i, j) >= x.approach
      && p.distance(t, i, j) <= x.converged
      && cosine(p.offset(t, i, j), way) <= Math.cos((70 * Math.PI) / 180));
    return pairs(baited).some(([i, k]) => dot(p.offset(t, i, j), p.offset(t, k, j)) <= 0);
  }),

  sidestepping: (p, x, t, { blocks }) => p.hunted.some((j) => p.hunters.some((i) => {
    if (!blocks[i][j][t] || !p.inTheWay(t, i, j, x.run, x.converged, 1)) return false;
    const direction = p.running(t, j, x.run), forward = dot(p.offset(t, i, j), direction);
    return range(x.escape - 1).some((more) => {
      const on = more + 2;
      if (!p.free(t, j, x.run, on)) return false;
      const way = minus(p.prey(t + on, j), p.prey(t, j)), after = p.offset(t + on, i, j);
      return dot(after, direction) < 0 && dot(way, direction) >= forward - 1 && cross(direction, way) !== 0
        && Math.abs(cross(after, direction)) <= x.near;
    });
  })),

  reversal: (p, x, t) => p.hunted.some((j) => {
    const direction = p.running(t, j, x.run);
    if (!p.free(t, j, x.run, x.escape)) return false;
    const turned = range(3).some((aside) => p.reaches(t, 0, x.run + aside)
      && dot(direction, p.running(t + x.run + aside, j, x.run)) < 0);
    if (!turned) return false;
    const forward = p.hunters.filter((i) => p.distance(t, i, j) <= x.reach).map((i) => dot(p.offset(t, i, j), direction));
    const nearest = (s) => Math.min(...p.hunters.map((i) => p.distance(s, i, j)));
    return forward.some((f) => f > 0) && forward.some((f) => f < 0) && nearest(t + x.escape) > nearest(t);
  }),

  herding: (p, x, t) => p.reaches(t, x.herd, 0) && pairs(p.hunted).some(([one, other]) => {
    const apart = (s) => span(p.between(s, one, other));
    if (!p.alive(t, one) || !p.alive(t, other) || apart(t) > x.reach || apart(t - x.herd) - apart(t) < x.gathered) return false;
    const driven = (s, j, inwards) => {
      const distances = p.hunters.map((i) => p.distance(s, i, j)), least = Math.min(...distances);
      return least <= x.reach && p.hunters.some((i) => distances[i] === least && dot(p.offset(s, i, j), inwards) < 0);
    };
    const both = (s) => driven(s, one, p.between(s, one, other)) && driven(s, other, p.between(s, one, other).map((a) => -a));
    return p.count(t, x.herd, both) >= x.driven * x.herd;
  }),

  "simultaneous capture": (p, x, t) => {
    const times = p.capturedAt.filter((at) => at < p.rows).sort((a, b) => a - b);
    return times.some((at, k) => k > 0 && at === t && at - times[k - 1] <= x.together);
  },

  scattering: (p, x, t) => pairs(p.hunted).some(([one, other]) => {
    const apart = (s) => span(p.between(s, one, other));
    const nearer = (s, i) => Math.min(p.distance(s, i, one), p.distance(s, i, other));
    if (apart(t) > x.near || !p.free(t, one, x.wait, x.escape) || !p.free(t, other, x.wait, x.escape)) return false;
    if (p.hunters.filter((i) => nearer(t - x.wait, i) - nearer(t, i) >= x.approach && nearer(t, i) <= x.near).length < 2) return false;
    const before = [one, other].map((j) => minus(p.prey(t, j), p.prey(t - x.wait, j)));
    const after = [one, other].map((j) => minus(p.prey(t + x.escape, j), p.prey(t, j)));
    return apart(t + x.escape) - apart(t) >= x.escape && cosine(after[0], after[1]) <= 0
      && [0, 1].some((k) => dot(before[k], after[k]) <= 0) && after.every((way) => 2 * span(way) >= x.escape);
  }),
};

const pairs = (list) => list.flatMap((one, k) => list.slice(0, k).map((other) => [one, other]));
const lengthsOfCircles = (x) => range(Math.floor((x.circle - 8) / 4) + 1).map((k) => 8 + 4 * k);

// Return the stretches [first, last] of each behaviour, and which agents attack (2) or block (1) at which rows.
function behavioursOf(match, env, thresholds) {
  const paths = new Paths(match, env), roles = rolesOf(paths, thresholds), found = {};
  for (const [name, rule] of Object.entries(RULES)) {
    const stretches = [];
    for (let t = 0; t <= match.length; t++) {
      if (!rule(paths, thresholds, t, roles)) continue;
      if (stretches.length && stretches.at(-1)[1] === t - 1) stretches.at(-1)[1] = t;
      else stretches.push([t, t]);
    }
    if (stretches.length) found[name] = stretches;
  }
  const role = range(paths.rows).map((t) => paths.hunters.map((i) => (
    roles.attacks[i].some((rows) => rows[t]) ? 2 : roles.blocks[i].some((rows) => rows[t]) ? 1 : 0)));
  return { found, role };
}
