// Links to a moment of a match, for example "#p=254&q=254&start=17&step=102": generations of predators and prey, number
// of the start as the page shows it, and step. Cells of the reader's own stand in start as "x,y,x,y,...". On a page of
// several runs, pr and qr are their numbers.

const ROLES = { p: "predators", q: "prey" };

// Return the hash of what the player shows.
function linkOf(player) {
  const said = new URLSearchParams();
  for (const [letter, side] of Object.entries(ROLES)) {
    const { run, generation } = player[side];
    if (generation !== undefined) said.set(letter, generation);
    if (player.sides.length > 1) said.set(`${letter}r`, run);
  }
  said.set("start", typeof player.start === "number" ? player.start + 1 : player.start.flat().join(","));
  said.set("step", Math.floor(player.time));
  return `#${said.toString().replaceAll("%2C", ",")}`;
}

// Return what player.show() needs for a hash; null if the hash names no moment. What cannot be shown is left out.
function momentOf(hash, player) {
  const said = new URLSearchParams(hash.slice(1)), { env, data } = player;
  if (!["p", "q", "start", "step"].some((name) => said.has(name))) return null;
  const whole = (name, top) => (/^\d+$/.test(said.get(name) ?? "") && Number(said.get(name)) <= top ? Number(said.get(name)) : undefined);
  const moment = { step: whole("step", env.max_cycles) ?? 0 };
  for (const [letter, side] of Object.entries(ROLES)) {
    const run = whole(`${letter}r`, player.sides.length - 1) ?? 0;
    if (player.sides[run]) moment[side] = { run, generation: whole(letter, Infinity) };
  }
  const numbers = (said.get("start") ?? "").split(",").map(Number), agents = env.n_predators + env.n_prey;
  const inside = (top) => numbers.every((each) => Number.isInteger(each) && each >= 0 && each < top);
  if (numbers.length === 2 * agents && inside(env.size)) {
    moment.start = range(agents).map((i) => numbers.slice(2 * i, 2 * i + 2));
  } else if (numbers.length === 1 && numbers[0] > 0 && inside(data.starts.length + 1)) {
    moment.start = numbers[0] - 1;
  }
  return moment;
}

// Follow the links of the page's address, and let a button write one. Return whether the address named a moment.
function followLinks(player, button, said) {
  const follow = () => {
    const moment = momentOf(location.hash, player);
    if (moment) player.show(moment);
    return moment !== null;
  };
  button.addEventListener("click", async () => {
    if (player.match.steered >= 0) {
      said.textContent = "A game of your own has no link.";
      return;
    }
    history.replaceState(null, "", linkOf(player));
    try {
      await navigator.clipboard.writeText(location.href);
      said.textContent = "The link is copied.";
    } catch {
      said.textContent = "The link stands in the address bar.";
    }
  });
  window.addEventListener("hashchange", follow);
  return follow();
}
