// The panel that explains an agent's action: inputs and votes of each of its networks, the action that results, and a
// picture of what a network wants.

class Thoughts {
  // choose: called with the agent that was clicked.
  constructor(place, game, moves, choose) {
    Object.assign(this, { game, moves, network: 0, pointed: null });
    this.buttons = range(game.agents).map((agent) => buttonOf(this.nameOf(agent), () => choose(agent)));
    this.answer = element("div", { className: "votes" });
    // Its rows are replaced in every step, so it listens itself, to the press already.
    const networkAt = ({ target }) => target.closest("[data-network]")?.dataset.network;
    this.#points(this.answer, networkAt, (network) => [this.agent, Number(network)]);
    for (const kind of ["pointerdown", "click"]) {
      this.answer.addEventListener(kind, (event) => { this.network = Number(networkAt(event) ?? this.network); this.#picture(); });
    }
    this.buttons.forEach((button, agent) => this.#points(button, () => agent, () => [agent, 0]));
    this.wants = new Wants(game, moves, (agent) => this.nameOf(agent));
    place.replaceChildren(element("h3", { textContent: "Why does it move so?" }), element("div", {}, this.buttons),
      element("div", { className: "why" }, [this.answer, this.wants.place]));
  }

  nameOf(agent) {
    const { n_predators } = this.game.rules;
    return agent < n_predators ? `predator ${agent}` : `prey ${LETTERS[(agent - n_predators) % LETTERS.length]}`;
  }

  show(match, step, agent) {
    if (agent !== this.agent) this.network = 0;
    Object.assign(this, { match, step, agent });
    this.buttons.forEach((button, each) => { button.ariaPressed = String(each === agent); });
    const focused = document.activeElement?.closest(".votes [data-network]")?.dataset.network;
    this.answer.replaceChildren(...this.#why(match, step, agent));
    this.answer.querySelector(`[data-network="${focused}"] button`)?.focus({ preventScroll: true });
    this.#picture();
  }

  // Show what another agent wants while the mouse is over it; -1 when it has left.
  hover(agent) {
    this.pointed = agent < 0 ? null : [agent, 0];
    this.#picture();
  }

  // Show what the agent and network wants that the mouse or the focus is on, else the chosen ones.
  #picture() {
    this.wants.show(this.match, this.step, ...(this.pointed ?? [this.agent, this.network]));
  }

  // While the mouse or the focus is in an element, find() returns something and pointed() the agent and network meant.
  #points(place, find, pointed) {
    const point = (event) => {
      const found = find(event);
      this.pointed = found === undefined ? null : pointed(found);
      this.#picture();
    };
    for (const kind of ["mouseover", "focusin"]) place.addEventListener(kind, point);
    for (const kind of ["mouseleave", "focusout"]) place.addEventListener(kind, () => this.hover(-1));
  }

  #does(action) {
    return this.moves[action] === "idle" ? "stands still" : `goes ${this.moves[action]}`;
  }

  #why(match, step, agent) {
    const { rules } = this.game, name = this.nameOf(agent);
    const say = (text) => [element("p", { className: "hint", textContent: text })];
    if (agent >= rules.n_predators && match.caughtAt[agent - rules.n_predators] <= step) return say(`${name} is caught.`);
    if (step >= match.length) return say("The match is over: nobody moves any more.");
    const team = agent < rules.n_predators ? match.predators : match.prey, action = match.actions[step][agent];
    if (agent === match.steered) return say(`${name} ${this.#does(action)}: you steered it.`);
    const thoughts = this.game.thoughts(match, step, agent);
    if (!thoughts) return say(`${name} ${this.#does(action)}, as its script ${team.name} says.`);
    const actions = this.moves.slice(0, team.controller.n_actions);
    const head = element("tr", {}, [element("th"), ...actions.map((move, k) => (
      element("th", { textContent: move, className: k === action ? "chosen" : "" })))]);
    const caught = (prey) => match.caughtAt[prey] <= step;
    const rows = thoughts.networks.map((network, i) => this.#row(i, this.#reads(network, agent, i, team, caught), network.outputs, action));
    const total = this.#row(rows.length, team.controller.combines ? "the combiner decides" : "sum of votes", thoughts.votes, action);
    const how = team.controller.draws ? "drawn by the votes" : "the most votes";
    return [element("table", {}, [
      element("caption", { textContent: `Step ${step}: ${name} ${this.#does(action)} (${how})` }),
      element("thead", {}, [head]), element("tbody", {}, rows), element("tfoot", {}, [total]),
    ])];
  }

  #reads({ combiner, inputs }, agent, i, { controller }, caught) {
    if (combiner) return `network ${i + 1} reads the others' votes`;
    if (controller.n_together > 1) return `network ${i + 1} reads what its whole team sees`;
    if (controller.sight.kind !== "Sight") return `network ${i + 1} reads (${inputs.map((input) => Number(input.toFixed(2))).join(", ")})`;
    const { sight, wiring } = controller, { n_predators, n_prey, size } = this.game.rules, hunts = agent < n_predators;
    const scale = controller.input_scale * (sight.scaled ? 2 / size : 1), n_opponents = hunts ? n_prey : n_predators;
    const n_others = n_opponents + (sight.teammates ? n_predators + n_prey - n_opponents - 1 : 0);
    const nameOf = (each) => {
      if (each < n_opponents && sight.nearest_first) return `opponent ${each + 1} by distance`;
      if (each < n_opponents) return this.nameOf(hunts ? n_predators + each : each);
      const mate = each - n_opponents + (hunts ? 0 : n_predators);
      return this.nameOf(mate < agent ? mate : mate + 1);
    };
    const whom = wiring[i].filter((entry, k) => k % 2 === 0 && entry < 2 * n_others).map((entry) => entry / 2);
    const seen = whom.map((each, k) => {
      const offset = [inputs[2 * k], inputs[2 * k + 1]].map((part) => Math.round(part / scale));
      const known = each < n_opponents && !sight.nearest_first;
      return `${nameOf(each)} ${known && hunts && caught(each) ? "as caught" : "at"} (${offset.join(", ")})`;
    });
    return `network ${i + 1} reads ${seen.join(", ")}${sight.moves ? ", and their last moves" : ""}`;
  }

  // Return a row of votes. Its name is a button that keeps the picture of its network.
  #row(network, name, outputs, action) {
    const least = Math.min(0, ...outputs), widest = Math.max(1e-9, ...outputs) - least;
    const button = element("button", { type: "button", className: "network", textContent: name });
    const row = element("tr", {}, [element("th", {}, [button]), ...[...outputs].map((output, k) => {
      const bar = element("i");
      bar.style.width = `${(50 * (output - least)) / widest}px`;
      return element("td", { className: k === action ? "chosen" : "" }, [bar, output.toFixed(3)]);
    })]);
    row.dataset.network = network;
    return row;
  }
}
