// A game in which a person steers one agent against the evolved others, with arrow keys or the buttons of a pad.

const LIVE_PACE = 8; // steps per second
const ARROW_KEYS = { ArrowRight: "east", ArrowLeft: "west", ArrowUp: "north", ArrowDown: "south" };

class Yourself {
  // player: the Player, which shows the game and its replay.
  constructor(player, moves) {
    Object.assign(this, { player, moves, pad: byId("pad"), said: byId("how-it-went") });
    this.invitation = this.said.textContent;
    const nameOf = (agent) => player.thoughts.nameOf(agent);
    fill(byId("be"), range(player.game.agents).map((agent) => [agent, nameOf(agent)]));
    byId("be").value = player.env.n_predators; // being hunted is easier to understand
    byId("begin").addEventListener("click", () => (player.live ? this.stop("You stopped.") : this.begin(Number(byId("be").value))));
    for (const move of moves) {
      byId(`go-${move}`).addEventListener("click", () => this.go(move));
      byId(`go-${move}`).addEventListener("pointerdown", () => this.go(move));
    }
    document.addEventListener("keydown", (event) => this.#key(event), { capture: true });
  }

  // Begin a game from the chosen start. It waits for the first move.
  begin(agent) {
    const { player } = this, hunts = agent < player.env.n_predators;
    player.pause();
    Object.assign(this, { agent, hunts, action: -1, time: 0, start: player.cellsOf(player.start) });
    const teams = ["predators", "prey"].map((side) => player.team(side, player[side]));
    this.teams = teams;
    this.episode = new Episode(player.game, ...teams, this.start, agent);
    player.live = this;
    byId("result").textContent = "";
    byId("thoughts").hidden = byId("scrub").disabled = true;
    this.idles = hunts && player.env.predator_idle;
    byId("go-idle").hidden = !this.idles;
    this.#toggled();
    const how = `The arrow keys or the buttons steer${this.idles ? ", space stands still" : ""}.`;
    this.said.textContent = `You are ${player.thoughts.nameOf(agent)}, the one with the ring. ` +
      `${hunts ? "Catch the prey: be in its cell." : "Do not let a predator reach your cell."} ${how} Your first move begins the game.`;
    bring(byId("play"));
    byId("world").focus({ preventScroll: true });
    this.draw();
  }

  // Move on in a direction until the next call.
  go(move) {
    if (this.player.live !== this || (move === "idle" && !this.idles)) return;
    const waiting = this.action < 0;
    this.action = this.moves.indexOf(move);
    if (waiting) this.#run();
  }

  // End the game without a result.
  stop(text = this.invitation) {
    if (this.player.live !== this) return;
    this.player.live = null;
    byId("thoughts").hidden = byId("scrub").disabled = false;
    this.said.textContent = text;
    byId("scrub").max = this.player.match.length;
    this.#toggled();
    this.player.draw();
  }

  // Invite to another game, as the last one is no longer shown.
  invite() { this.said.textContent = this.invitation; }

  #run() {
    const { episode, player } = this;
    let last = null;
    const tick = (now) => {
      if (player.live !== this || this.episode !== episode) return;
      this.time += Math.min(0.1, (now - (last ?? now)) / 1000) * LIVE_PACE * player.speed;
      last = now;
      while (this.time > episode.match.length && !this.#ended()) episode.step(this.action);
      this.time = Math.min(this.time, episode.match.length);
      if (this.#ended() && this.time >= episode.match.length) this.#end();
      else {
        this.draw();
        requestAnimationFrame(tick);
      }
    };
    requestAnimationFrame(tick);
  }

  #caughtAt() { return this.episode.match.caughtAt[this.agent - this.player.env.n_predators]; }

  #ended() { return this.episode.over || (!this.hunts && this.#caughtAt() < Infinity); }

  draw() {
    const { match } = this.episode, { env, painter } = this.player, rows = match.length + 1;
    if (this.scene?.match !== match || this.scene.role.length < rows) {
      const cells = zeros_of(rows, env.n_predators + env.n_prey, 2);
      unwrap(match.cells, match.length, env.size, cells);
      this.scene = { match, episode: { cells }, role: zeros_of(rows, env.n_predators) };
    }
    painter.paint(this.scene, this.time, { chosen: this.agent });
    byId("clock").textContent = `${match.length} / ${env.max_cycles}`;
    Object.assign(byId("scrub"), { max: env.max_cycles, value: match.length });
  }

  // Say how it went, beside the evolved agent in the same place, and show the replay.
  #end() {
    const { player, episode, agent, hunts } = this, steps = episode.match.length;
    while (!episode.over) episode.step(this.action); // a caught person no longer matters to the rest
    const evolved = player.game.match(...this.teams, this.start), team = this.teams[hunts ? 0 : 1];
    const name = `${team.scripted ? "script's" : "evolved"} ${player.thoughts.nameOf(agent)}`;
    this.stop(hunts ? this.#hunted(episode.match, evolved, name) : this.#fled(evolved, steps, name));
    player.watch(player.marked(episode.match), steps);
  }

  #hunted({ caughtAt, length }, evolved, name) {
    const count = (times) => times.filter((at) => at < Infinity).length;
    return `Your team caught ${count(caughtAt)} of ${caughtAt.length} prey in ${counted(length, "step")}. ` +
      `With the ${name} in your place it catches ${count(evolved.caughtAt)} in ${counted(evolved.length, "step")}.`;
  }

  #fled(evolved, steps, name) {
    const yours = this.#caughtAt(), theirs = evolved.caughtAt[this.agent - this.player.env.n_predators];
    return `${yours < Infinity ? `You were caught at step ${yours}.` : `You escaped for ${steps === 1 ? "the only step" : `all ${steps} steps`}.`} ` +
      `The ${name} in your place ${theirs < Infinity ? `is caught at step ${theirs}` : "escapes"}.`;
  }

  #toggled() {
    const playing = this.player.live === this;
    this.pad.hidden = !playing;
    byId("begin").textContent = playing ? "Stop" : "Begin";
  }

  #key(event) {
    if (this.player.live !== this || event.ctrlKey || event.metaKey || event.altKey) return;
    const move = ARROW_KEYS[event.key] ?? (event.key === " " && !event.target.closest("button, select") ? "idle" : null);
    if (!move && event.key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    if (move) this.go(move);
    else this.stop("You stopped.");
  }
}
