// Matches that were recorded when the page was made, for a page that cannot compute them.

class Recording {
  // env: the world. matches: [{ run, predators, prey, caught, cells }, ...], as esp_trainer/report/recorded.py writes them.
  constructor(env, matches) {
    this.agents = env.n_predators + env.n_prey;
    this.Cells = env.size > 256 ? Uint16Array : Uint8Array;
    this.matches = new Map(matches.map((recorded) => {
      const match = this.#decoded(recorded), { run, predators, prey } = recorded;
      return [this.#key(run, predators, prey, match.start), match];
    }));
  }

  // Return the match between two generations of a run from a start, [[x, y], ...]; undefined if it was not recorded.
  match(predators, prey, start) {
    return this.matches.get(this.#key(predators.run, predators.generation, prey.generation, start));
  }

  #key(run, predators, prey, start) { return [run, predators ?? "", prey ?? "", ...start.flat()].join(); }

  // Return a match in the form in which Game plays one, without what only a computed match has.
  #decoded({ caught, cells }) {
    const flat = new this.Cells(bytesOf(cells)), rows = flat.length / (2 * this.agents);
    const at = (row) => range(this.agents).map((agent) => [...flat.subarray(2 * (row * this.agents + agent)).slice(0, 2)]);
    const caughtAt = caught.map((step) => step || Infinity);
    return { start: at(0), cells: range(rows).map(at), caughtAt, length: rows - 1, steered: -1 };
  }
}
