// The timeline of a match: a row for the captures, and one for each detected behaviour.

class Timeline {
  // seek: called with the step that was clicked.
  constructor(place, behaviours, seek) {
    Object.assign(this, { place, behaviours, seek, cursors: [] });
  }

  show({ match, found }) {
    const rows = [];
    const captures = match.caughtAt.filter((at) => at < Infinity);
    if (captures.length) rows.push(["capture", "a prey is caught", "capture", captures.map((at) => [at, at])]);
    for (const [name, stretches] of Object.entries(found)) {
      const { meaning, who } = this.behaviours[name];
      rows.push([name, meaning, ["attacker", "blocker"].includes(name) ? name : who, stretches]); // in their roles' colours
    }
    this.length = Math.max(1, match.length);
    this.cursors = [];
    this.place.replaceChildren(...rows.map((row) => this.#row(...row)));
  }

  #row(name, meaning, kind, stretches) {
    const label = element("span", { textContent: name, title: meaning }), cursor = element("b");
    const part = (step) => `${(100 * step) / this.length}%`;
    const bars = stretches.map(([first, last]) => {
      const bar = element("i", { className: kind, title: `${name}, step ${first}${last > first ? ` to ${last}` : ""}` });
      Object.assign(bar.style, { left: part(first), width: part(last - first) });
      return bar;
    });
    const track = element("div", { className: "track" }, [...bars, cursor]);
    track.addEventListener("click", (event) => {
      const box = track.getBoundingClientRect();
      this.seek(Math.round(((event.clientX - box.left) / box.width) * this.length));
    });
    this.cursors.push(cursor);
    return element("div", { className: "row" }, [label, track]);
  }

  at(time) {
    for (const cursor of this.cursors) cursor.style.left = `${(100 * Math.min(time, this.length)) / this.length}%`;
  }
}
