// Matches between teams, and what the networks of an agent compute in them.

const IDLE = 4;

// Plays matches between teams, which are objects that Side.team() returns.
class Game {
  // rules: the world in the form that compiled code reads.
  constructor({ rules, memory, seen }) {
    this.rules = rules;
    this.seen = seen; // number of rows for the observations of a team
    this.memory = memory; // least number of rows of memory of an agent
    this.agents = rules.n_predators + rules.n_prey;
  }

  // Play two teams from a start, [[x, y], ...] with the predators first.
  match(predators, prey, start) {
    const episode = new Episode(this, predators, prey, start);
    while (!episode.over) episode.step();
    return episode.match;
  }

  // Return inputs and outputs of an agent's networks at a step of a match, [{ inputs, outputs }, ...], and the sum of
  // their votes. Return null for a scripted team, which has no networks.
  thoughts(match, step, agent) {
    const team = this.#teamOf(match, agent);
    if (team.scripted) return null;
    return this.#votes(match, step, agent, this.#see(this.#situation(match, step, agent), agent, team.controller));
  }

  // Return the thoughts that an agent would have if another one stood elsewhere: one for each offset, [dx, dy], of the
  // other one from the agent.
  thoughtsIf(match, step, agent, other, offsets) {
    const team = this.#teamOf(match, agent), { size } = this.rules;
    const situation = this.#situation(match, step, agent), { x, y } = situation.world;
    return offsets.map(([dx, dy]) => {
      x[other] = (x[agent] + dx + size) % size;
      y[other] = (y[agent] + dy + size) % size;
      return this.#votes(match, step, agent, this.#see(situation, agent, team.controller));
    });
  }

  #teamOf(match, agent) {
    return agent < this.rules.n_predators ? match.predators : match.prey;
  }

  // Return what the networks of an agent make of an observation at a step of a match, with what they remember.
  #votes(match, step, agent, seen) {
    const { controller, weights } = this.#teamOf(match, agent);
    const member = agent < this.rules.n_predators ? agent : agent - this.rules.n_predators;
    const { n_actions, network: { n_hidden, n_genes, n_memory } } = controller, networks = [], genome = Math.floor(member / controller.n_together);
    const memory = match.memories[step].slice();
    let at = genome * controller.fan_in.length * n_hidden * n_genes, context = agent * match.n_memory + 1;
    controller.fan_in.forEach((n_inputs, network) => {
      const combiner = network === controller.n_networks;
      const read = combiner
        ? networks.flatMap((other) => [...other.outputs])
        : controller.wiring[network].map((entry) => Math.fround(seen[entry] * controller.input_scale));
      const inputs = Float32Array.from([...read, 1]), outputs = new Float32Array(n_actions);
      add_votes(controller, weights, at, inputs, n_inputs, member % controller.n_together, outputs, 0, memory, context);
      networks.push({ combiner, inputs: read, outputs });
      at += n_hidden * n_genes;
      context += n_memory;
    });
    const votes = new Float32Array(n_actions), deciding = controller.combines ? networks.slice(-1) : networks;
    for (const { outputs } of deciding) outputs.forEach((output, action) => { votes[action] += output; });
    return { networks, votes };
  }

  // Return the world and the last moves that an agent saw when it chose its next action.
  #situation(match, step, agent) {
    const { rules } = this;
    const cells = match.cells[step], world = worldAt(cells, rules);
    match.caughtAt.forEach((at, j) => { world.alive[j] = at > step ? 1 : 0; });
    const moved = Int32Array.from(step > 0 ? match.actions[step - 1] : cells.map(() => IDLE));
    if (rules.prey_first && agent < rules.n_predators && step < match.length) { // in turns, predators see the prey's move
      moved.set(match.actions[step].slice(rules.n_predators), rules.n_predators);
      move_prey(world, match.actions[step], rules);
      capture(world, rules);
    }
    return { world, moved };
  }

  // Return the observation of an agent; for a central controller, that of the whole team.
  #see({ world, moved }, agent, { sight, n_together }) {
    const { rules } = this, seen = new Float32Array(this.seen);
    const first = n_together === 1 ? agent : agent < rules.n_predators ? 0 : rules.n_predators;
    for (let each = 0, row = 0; each < n_together; each++) row = observe(sight, world, moved, first + each, rules, seen, row);
    return seen;
  }
}
