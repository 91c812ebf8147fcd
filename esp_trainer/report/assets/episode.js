// An episode, played step by step by the translated rules. A person may steer one agent.

class Episode {
  // game: the Game. start: [[x, y], ...] with the predators first. steered: the agent whose actions step() is told, or -1.
  constructor(game, predators, prey, start, steered = -1) {
    const { rules, agents } = game;
    this.rules = rules;
    this.entrants = [predators, prey].map(entrant);
    this.seen = new Float32Array(game.seen);
    const n_memory = Math.max(game.memory, predators.controller.n_memory ?? 0, prey.controller.n_memory ?? 0);
    this.block = begun(game, start, n_memory);
    if (steered >= 0) this.block.actions = this.#steeredActions(agents, steered);
    this.match = { start, cells: [start.map((cell) => [...cell])], actions: [], memories: [], n_memory, length: 0, predators, prey, steered };
    this.match.caughtAt = Array(rules.n_prey).fill(Infinity);
  }

  get over() { return is_over(this.block.world, this.block.clock[0], this.rules); }

  // Play a step. action: that of the steered agent.
  step(action) {
    const { block, match, rules } = this, { world } = block;
    this.action = action;
    match.memories.push(block.memory.slice());
    play_step(block, ...this.entrants, rules, this.seen);
    match.cells.push(Array.from(world.x, (x, i) => [x, world.y[i]]));
    match.actions.push([...block.actions]);
    match.length += 1;
    match.caughtAt = Array.from(block.survived, (steps, j) => world.alive[j] ? Infinity : steps + 1);
  }

  // Return actions that keep a person's choice for one agent, whatever its team chooses.
  #steeredActions(agents, steered) {
    return Object.defineProperty(Array(agents).fill(0), steered, { get: () => this.action, set() {}, enumerable: true });
  }
}

// Return a block of one world at the start of an episode.
function begun({ rules, agents }, start, n_memory) {
  const seed = seed_of(Object.assign([...start], { shape: [agents, 2] }));
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
