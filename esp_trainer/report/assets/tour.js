// A tour of one minute: a few steps, each of which points at a part of the page. It opens only when it is asked for.

const STEPS = [
  ["#verdict", "What happened", "Two teams evolved against each other: predators hunt prey. This sentence says how it ended."],
  [".stage", "A chase", "Orange circles are predators, blue squares are prey. All move one cell a step. What leaves the " +
    "world on one side comes back on the opposite one. Space plays and pauses."],
  [".choice .predators", "A generation", "In each generation the better networks have offspring, and the best team plays on as " +
    "champion. The sliders choose whose champions meet: let early predators hunt late prey, then the reverse."],
  ["#matrix-figure", "Who catches whom", "Each cell is one pairing of generations: bright means that many prey are caught. Going " +
    "up, predators are later; going right, prey are. Bright at the top means better predators, dark at the right better prey."],
  ["#yourself", "Play yourself", "Take the place of one agent against the evolved others, and see how you do."],
  ["#thoughts", "Why does it move so?", "An agent's networks vote for a move. The picture shows what a network wants, wherever its " +
    "opponent stands. The glossary at the end of the page explains the words."],
];

// The tour of a page of another game, which has no player.
const STEPS_OF_GAME = [
  ["#verdict", "What happened", "Two teams evolved against each other, here called predators and prey. This sentence says how it ended."],
  ["#matrix-figure", "Who beats whom", "Each cell is one pairing of generations: bright means a high payoff to the predators. Going " +
    "up, predators are later; going right, prey are. Bright at the top means better predators, dark at the right better prey."],
];

class Tour {
  // button: what opens it. steps: what it shows. begin: called when it opens.
  constructor(button, steps, begin) {
    this.button = button;
    this.steps = steps.filter(([place]) => document.querySelector(place)?.getClientRects().length);
    this.title = element("h2", { id: "tour-title" });
    this.text = element("p");
    this.back = buttonOf("Back", () => this.show(this.at - 1));
    this.next = buttonOf("", () => (this.at + 1 < this.steps.length ? this.show(this.at + 1) : this.close()), { className: "next" });
    this.skip = buttonOf("Skip", () => this.close());
    this.box = element("div", { id: "tour", role: "dialog", hidden: true }, [
      this.title, this.text, element("div", { className: "bar" }, [this.back, this.next, this.skip]),
    ]);
    this.box.setAttribute("aria-labelledby", "tour-title");
    this.text.ariaLive = "polite";
    document.body.append(this.box);
    button.addEventListener("click", () => { begin(); this.show(0); });
    document.addEventListener("keydown", ({ key }) => { if (key === "Escape" && !this.box.hidden) this.close(); });
  }

  show(at) {
    this.at = at;
    const [place, title, text] = this.steps[at], pointed = this.#point(place);
    this.title.textContent = `${at + 1} of ${this.steps.length}: ${title}`;
    this.text.textContent = text;
    this.back.hidden = at === 0;
    this.skip.hidden = at + 1 === this.steps.length;
    this.next.textContent = at + 1 < this.steps.length ? "Next" : "Done";
    this.box.hidden = false;
    bring(pointed);
    this.next.focus({ preventScroll: true });
  }

  // Mark a part of the page, and return it.
  #point(place) {
    document.querySelector(".pointed")?.classList.remove("pointed");
    const pointed = place && document.querySelector(place);
    pointed?.classList.add("pointed");
    return pointed;
  }

  close() {
    this.#point(null);
    this.box.hidden = true;
    this.button.focus({ preventScroll: true });
  }
}
