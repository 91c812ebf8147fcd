// The champions that are stored in the page.

// One side of a run: its champions of some generations, or its script.
class Side {
  constructor({ name, script, controller, generations, genes }) {
    this.name = name; // name of a script
    this.script = tuple("number n_opponents n_actions in_turns", script ?? [0, 0, 0, false]);
    this.controller = controller ?? { n_together: 1, fan_in: [0], n_votes: 0, sight: { kind: "Sight" } };
    this.generations = generations ?? [];
    this.genes = genes ? floatsOf(genes) : new Float32Array(0);
  }

  get scripted() { return this.script.number !== 0; }

  // Return the n-th team of the side; a script is the only team of its side.
  team(n) {
    const { name, script, scripted, controller, generations } = this;
    const each = this.genes.length / Math.max(1, generations.length);
    return { name, script, scripted, controller, generation: generations[n], weights: this.genes.subarray(n * each, (n + 1) * each) };
  }
}

function floatsOf(base64) { return new Float32Array(bytesOf(base64)); }

function bytesOf(base64) { return Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)).buffer; }

// Return an array that also has its values as named fields, like a named tuple in Python.
function tuple(names, values) {
  return Object.assign([...values], Object.fromEntries(names.split(" ").map((name, i) => [name, values[i]])));
}
