// The player: selects a match and plays it.

const PACE = 12; // steps per second
const PAUSE = 1500; // milliseconds before the first chase plays again
const A_WHILE = 5 * PACE; // steps that the first chase on the page lasts, if it can

class Player {
  constructor(data, on) {
    const { env, behaviours, moves } = data.world;
    Object.assign(this, { data, env, on });
    this.recording = data.recorded ? new Recording(env, data.recorded) : null; // null if matches are computed
    this.game = new Game(data.world);
    this.sides = data.runs.map((run) => run.sides && { predators: new Side(run.sides.predators), prey: new Side(run.sides.prey) });
    this.painter = new Painter(byId("world"), env);
    this.timeline = new Timeline(byId("timeline"), behaviours, (step) => this.seek(step));
    const choose = (agent) => { this.agent = agent; this.draw(); };
    this.thoughts = this.recording ? null : new Thoughts(byId("thoughts"), this.game, moves, choose);
    this.live = null; // a game in which a person plays, instead of the match
    this.agent = this.recording ? -1 : 0;
    this.speed = 1;
    this.time = 0;
    this.playing = false;
    this.#controls();
  }

  // Show a match between generations of runs, both by number. start: number of a start, or cells. Where it is not
  // recorded, show the nearest of those that are.
  show({ predators, prey, start, name = "your own", step = 0 }) {
    const first = this.sides.findIndex(Boolean);
    this.predators = this.pick("predators", predators ?? this.predators ?? { run: first });
    const same = this.recording && { run: this.predators.run }; // only generations of one run met
    this.prey = this.pick("prey", { ...(prey ?? this.prey ?? { run: first }), ...same });
    if (start !== undefined) Object.assign(this, { start, startName: name });
    if (!this.#match(this.predators, this.prey, this.start)) this.#toNearest();
    this.watch(this.played(this.predators, this.prey, this.start), step);
  }

  // Show a match that was played, with everything that is drawn of it.
  watch(scene, step) {
    this.live?.stop();
    Object.assign(this, { scene, match: scene.match, time: Math.min(step, scene.match.length) });
    this.pause();
    this.#settle();
    this.draw();
  }

  // Return a match with everything that is drawn of it.
  played(predators, prey, start) { return this.marked(this.#match(predators, prey, start)); }

  #match(predators, prey, start) {
    const cells = this.cellsOf(start);
    if (this.recording) return this.recording.match(predators, prey, cells);
    return this.game.match(this.team("predators", predators), this.team("prey", prey), cells);
  }

  // Choose the generations and the start that the sliders can show.
  #toNearest() {
    for (const side of ["predators", "prey"]) this[side] = this.pick(side, { run: this[side].run, n: this[side].n });
    if (typeof this.start !== "number") this.start = 0;
  }

  marked(match) { return { match, ...behavioursOf(match, this.data.world) }; }

  team(side, { run, n }) { return this.sides[run][side].team(n); }

  cellsOf(start) { return typeof start === "number" ? this.data.starts[start] : start; }

  // Return the start from which the match of the last generations ends with the most prey caught; of several the first
  // that plays for a while, or the longest.
  eventful() {
    const last = ["predators", "prey"].map((side) => this.pick(side, { run: this.sides.findIndex(Boolean) }));
    let [best, most, longest] = [0, 0, 0];
    for (const i of this.data.starts.keys()) {
      const { caughtAt, length } = this.#match(...last, i);
      const caught = caughtAt.filter((at) => at < Infinity).length;
      if (caught > most || (caught > 0 && caught === most && length > longest)) [best, most, longest] = [i, caught, length];
      if (most === caughtAt.length && longest >= A_WHILE) break;
    }
    return best;
  }

  // Return the kept generation nearest to the requested one; by default the last. Where matches are recorded, return the
  // requested one, as that of a moment may not be one of the slider's.
  pick(side, { run, generation, n }) {
    const kept = this.sides[run][side].generations;
    const wanted = n ?? (generation === undefined ? kept.length - 1 : nearest_of(kept, generation));
    const exact = this.recording && n === undefined && kept.length ? generation : undefined;
    return { run, n: Math.max(0, Math.min(wanted, kept.length - 1)), generation: exact ?? kept[Math.max(0, wanted)] };
  }

  draw() {
    if (this.live) {
      this.live.draw();
      return;
    }
    const step = Math.floor(this.time);
    this.painter.paint(this.scene, this.time, { chosen: this.agent });
    this.timeline.at(this.time);
    byId("scrub").value = step;
    byId("clock").textContent = `${step} / ${this.match.length}`;
    if (step !== this.drawn || this.agent !== this.asked || this.match !== this.of) {
      this.thoughts?.show(this.match, step, this.agent);
      Object.assign(this, { drawn: step, asked: this.agent, of: this.match });
    }
  }

  // Play to the end, and then from the beginning, as often as is asked for.
  play(rounds = 1) {
    this.live?.stop();
    if (this.time >= this.match.length) this.time = 0;
    this.playing = true;
    this.#toggled();
    const turn = (this.turn ?? 0) + 1; // ends the loop of an earlier play()
    this.turn = turn;
    let last = null;
    const tick = (now) => {
      if (!this.playing || this.turn !== turn) return;
      const seconds = Math.min(0.1, (now - (last ?? now)) / 1000); // without the time spent in another tab
      this.time = Math.min(this.match.length, this.time + seconds * PACE * this.speed);
      last = now;
      this.draw();
      if (this.time < this.match.length) requestAnimationFrame(tick);
      else if (rounds > 1) setTimeout(() => { if (this.playing && this.turn === turn) this.play(rounds - 1); }, PAUSE);
      else this.pause();
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    this.#toggled();
  }

  #toggled() {
    byId("toggle").classList.toggle("playing", this.playing);
    byId("toggle").ariaLabel = this.playing ? "pause" : "play";
  }

  seek(step) {
    this.live?.stop();
    this.pause();
    this.time = Math.max(0, Math.min(this.match.length, step));
    this.draw();
  }

  // Update all elements that show which match is selected.
  #settle() {
    for (const side of ["predators", "prey"]) {
      const { run, n, generation } = this[side], { name, generations } = this.sides[run][side];
      byId(`${side}-run`).value = run;
      Object.assign(byId(side), { max: Math.max(0, generations.length - 1), value: n, disabled: generations.length < 2 });
      byId(`${side}-by`).textContent = name ? "by the script" : "of generation";
      byId(`${side}-generation`).textContent = name ?? generation;
      byId(side).setAttribute("aria-valuetext", name ?? `generation ${generation}`);
    }
    const given = typeof this.start === "number";
    if (given) byId("start").value = this.start;
    byId("start-name").textContent = given ? `${this.start + 1} of ${this.data.starts.length}` : this.startName;
    byId("scrub").max = this.match.length;
    this.timeline.show(this.scene);
    const times = this.match.caughtAt, caught = times.filter((at) => at < Infinity);
    const result = caught.length
      ? `${caught.length} of ${times.length} prey caught, ${caught.length > 1 ? "at steps" : "at step"} ${caught.sort((a, b) => a - b).join(", ")}.`
      : `No prey is caught in ${counted(this.match.length, "step")}.`;
    byId("result").textContent = result + this.#onAverage();
    this.on();
  }

  // Return what the matrix says of the two teams, as one match may be an exception; nothing where it does not hold them.
  #onAverage() {
    const { predators, prey, data: { matrix } } = this;
    if (!matrix || predators.run !== prey.run || this.match.steered >= 0) return "";
    const row = matrix.predators.indexOf(predators.generation ?? 0), column = matrix.prey.indexOf(prey.generation ?? 0);
    const caught = matrix.matrices[predators.run]?.[row]?.[column] ?? null;
    return caught === null ? "" : ` From all ${matrix.n_starts} starts ${caught.toFixed(2)} of the prey are caught.`;
  }

  #controls() {
    const { data } = this;
    byId("toggle").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    byId("back").addEventListener("click", () => this.seek(Math.ceil(this.time) - 1));
    byId("forward").addEventListener("click", () => this.seek(Math.floor(this.time) + 1));
    byId("scrub").addEventListener("input", (event) => this.seek(Number(event.target.value)));
    byId("speed").addEventListener("change", (event) => { this.speed = Number(event.target.value); });
    byId("start").max = data.starts.length - 1;
    const again = () => this.show({ start: Number(byId("start").value) });
    byId("start").addEventListener("input", again);
    // A click on the slider at its value gives no input event, but must lead back from cells of the user's own.
    for (const kind of ["pointerup", "keyup"]) byId("start").addEventListener(kind, () => typeof this.start !== "number" && again());
    for (const side of ["predators", "prey"]) {
      const runs = byId(`${side}-run`);
      fill(runs, data.runs.map((run, i) => [i, run.name, !run.sides]));
      runs.hidden ||= this.recording && side === "prey"; // they follow the run of the predators
      runs.addEventListener("change", () => this.show({ [side]: { ...this[side], n: undefined, run: Number(runs.value) } }));
      byId(side).addEventListener("input", (event) => this.show({ [side]: { run: this[side].run, n: Number(event.target.value) } }));
    }
  }
}

const nearest_of = (kept, generation) => kept.reduce((best, each, i) => (
  Math.abs(each - generation) < Math.abs(kept[best] - generation) ? i : best), 0);
