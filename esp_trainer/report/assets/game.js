// Matches, played in the page by the translated rules.

const IDLE = 4;
const LEAST_MEMORY = 4; // rows of memory of an agent, as in predprey_env/policies/protocol.py

// Plays matches between teams, which are objects that Side.team() returns.
class Game {
  // rules: the world in the form that compiled code reads.
  constructor({ rules }) {
    this.rules = rules;
    this.agents = rules.n_predators + rules.n_prey;
  }

  // Play two teams from a start, [[x, y], ...] with the predators first.
  match(predators, prey, start) {
    const { rules, agents } = this, entrants = [predators, prey].map(entrant);
    const n_memory = Math.max(LEAST_MEMORY, predators.controller.n_memory ?? 0, prey.controller.n_memory ?? 0);
    const block = this.#begin(start, n_memory), seen = new Float32Array(sight_rows(rules));
    const cells = [start.map((cell) => [...cell])], actions = [], memories = [];
    while (!is_over(block.world, block.clock[0], rules)) {
      memories.push(block.memory.slice());
      play_step(block, ...entrants, rules, seen);
      cells.push(Array.from({ length: agents }, (_, i) => [block.world.x[i], block.world.y[i]]));
      actions.push([...block.actions]);
    }
    const caughtAt = Array.from(block.survived, (steps, j) => block.world.alive[j] ? Infinity : steps + 1);
    return { start, cells, actions, memories, n_memory, caughtAt, length: actions.length, predators, prey };
  }

  #begin(start, n_memory) {
    const { rules, agents } = this, seed = seed_of(Object.assign([...start], { shape: [agents, 2] }));
    const block = {
      world: worldAt(start, rules),
      clock: new Int32Array(1),
      survived: new Int32Array(rules.n_prey),
      actions: new Int32Array(agents),
      moved: new Int32Array(agents).fill(IDLE),
      memory: new Int32Array(agents * n_memory),
    };
    for (let agent = 0; agent < agents; agent++) {
      const hunted = agent >= rules.n_predators, number = agent - (hunted ? rules.n_predators : 0);
      for (let row = 0; row < n_memory; row++) block.memory[agent * n_memory + row] = first_memory(seed, hunted, number, row);
    }
    return block;
  }

  // Return inputs and outputs of an agent's networks at a step of a match, [{ inputs, outputs }, ...], and the sum of
  // their votes. Return null for a scripted team, which has no networks.
  thoughts(match, step, agent) {
    const { rules } = this, hunts = agent < rules.n_predators, team = hunts ? match.predators : match.prey;
    if (team.scripted) return null;
    const controller = team.controller;
    const member = hunts ? agent : agent - rules.n_predators;
    const seen = this.#view(match, step, agent, controller);
    const { n_actions, network: { n_hidden, n_genes, n_memory } } = controller, networks = [], genome = Math.floor(member / controller.n_together);
    const memory = match.memories[step].slice();
    let at = genome * controller.fan_in.length * n_hidden * n_genes, context = agent * match.n_memory + 1;
    controller.fan_in.forEach((n_inputs, network) => {
      const combiner = network === controller.n_networks;
      const read = combiner
        ? networks.flatMap((other) => [...other.outputs])
        : controller.wiring[network].map((entry) => Math.fround(seen[entry] * controller.input_scale));
      const inputs = Float32Array.from([...read, 1]), outputs = new Float32Array(n_actions);
      add_votes(controller, team.weights, at, inputs, n_inputs, member % controller.n_together, outputs, 0, memory, context);
      networks.push({ combiner, inputs: read, outputs });
      at += n_hidden * n_genes;
      context += n_memory;
    });
    const votes = new Float32Array(n_actions), deciding = controller.combines ? networks.slice(-1) : networks;
    for (const { outputs } of deciding) outputs.forEach((output, action) => { votes[action] += output; });
    return { networks, votes };
  }

  // Return the observation from which an agent chose its next action; for a central controller, that of the whole team.
  #view(match, step, agent, controller) {
    const { rules } = this, hunts = agent < rules.n_predators;
    const cells = match.cells[step], world = worldAt(cells, rules);
    match.caughtAt.forEach((at, j) => { world.alive[j] = at > step ? 1 : 0; });
    const moved = Int32Array.from(step > 0 ? match.actions[step - 1] : cells.map(() => IDLE));
    if (rules.prey_first && hunts && step < match.length) { // in turns, predators see the prey's move
      moved.set(match.actions[step].slice(rules.n_predators), rules.n_predators);
      move_prey(world, match.actions[step], rules);
      capture(world, rules);
    }
    const { sight, n_together } = controller, seen = new Float32Array(sight_rows(rules));
    const together = n_together > 1, first = together ? (hunts ? 0 : rules.n_predators) : agent;
    for (let each = 0, row = 0; each < n_together; each++) row = observe(world, moved, first + each, rules, sight, seen, row);
    return seen;
  }
}

// Return a team as the player of the translated rules.
function entrant({ script, controller, weights }) {
  const inputs = new Float32Array(Math.max(...controller.fan_in) + 1), votes = new Float32Array(controller.n_votes);
  return { script, networks: { controller, weights, inputs, votes } };
}

function worldAt(cells, rules) {
  return {
    x: Int32Array.from(cells, (cell) => cell[0]),
    y: Int32Array.from(cells, (cell) => cell[1]),
    alive: new Int32Array(rules.n_prey).fill(1),
  };
}
