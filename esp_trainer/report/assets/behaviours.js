// The behaviours that are seen in a match, by the translated detectors of esp_trainer/analysis/behaviours.

const range = (n) => Array.from({ length: n }, (_, i) => i);
const minus = (a, b) => [a[0] - b[0], a[1] - b[1]];

// Return an array of the given lengths, nested, filled with zeros.
const zeros_of = (n, ...inner) => range(n).map(() => (inner.length ? zeros_of(...inner) : 0));

// Return a match as the detectors read it, a set of one episode without roles so far.
function episodesOf(match, { n_predators, n_prey, size }) {
  const rows = match.length + 1, agents = n_predators + n_prey;
  const cells = zeros_of(1, rows, agents, 2), offsets = zeros_of(1, rows, agents, n_prey, 2);
  unwrap(match.cells, match.length, size, cells[0]);
  measure_offsets(match.cells, n_predators, size, offsets[0]);
  const [attacks, blocks] = range(2).map(() => zeros_of(1, rows, n_predators, n_prey));
  return { cells, offsets, capture_times: [match.caughtAt], lengths: [match.length], n_predators, n_prey, attacks, blocks };
}

// Return a match as an episode; the stretches [first, last] of each behaviour; and which predators attack (2) or block
// (1), [row][predator].
function behavioursOf(match, { env, thresholds, behaviours }) {
  const episodes = episodesOf(match, env), rows = match.length + 1, found = {};
  const seen = Object.fromEntries(Object.values(behaviours).map(({ detector }) => [detector, zeros_of(1, rows)]));
  detect(episodes, thresholds, seen);
  for (const [name, { detector, defined }] of Object.entries(behaviours)) {
    const marked = stretches(seen[detector][0]);
    if (defined && marked.length) found[name] = marked;
  }
  const episode = episode_of(episodes, 0);
  const role = range(rows).map((row) => range(env.n_predators).map((i) => role_towards_any(episode, row, i)));
  return { episode, found, role };
}

// Return the first and last index of each stretch of true values.
function stretches(marks) {
  const found = [];
  marks.forEach((mark, at) => {
    if (mark && marks[at - 1]) found.at(-1)[1] = at;
    else if (mark) found.push([at, at]);
  });
  return found;
}
