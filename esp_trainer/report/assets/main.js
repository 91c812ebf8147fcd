// The page comes to life.

const data = JSON.parse(byId("data").textContent);
const playable = data.runs.some((run) => run.sides) && data.starts.length > 0;
let charts = null;
const player = playable ? new Player(data, (shown) => charts?.mark(shown)) : null;

function theme(name) {
  document.documentElement.dataset.theme = name;
  charts?.draw();
  player?.draw();
  moments();
}

const CLOSE_UP = 50; // cells to a side in the picture of a moment
const closest = (paths, step, prey) => Math.min(...paths.hunters.map((i) => paths.distance(step, i, prey)));

// A picture of each moment, about the prey that is nearest to a predator; it plays the moment.
function moments() {
  const place = document.querySelector(".moments");
  if (!player || !data.moments.length) return;
  byId("moments").hidden = false;
  place.replaceChildren(...data.moments.map((moment) => {
    const canvas = element("canvas"), team = { run: moment.run, generation: moment.generation };
    const button = element("button", { type: "button" }, [canvas, element("strong", { textContent: moment.title }),
      element("small", { textContent: moment.text }),
      element("small", { textContent: `${data.runs.length > 1 ? `${data.runs[moment.run].name}, ` : ""}generation ${moment.generation}, step ${moment.step}` })]);
    button.addEventListener("click", () => {
      player.show({ predators: team, prey: team, start: moment.start, name: "of this moment", step: moment.shown[0] });
      byId("play").scrollIntoView({ behavior: "smooth", block: "start" });
      player.play();
    });
    return button;
  }));
  place.querySelectorAll("canvas").forEach((canvas, i) => {
    const moment = data.moments[i], team = { run: moment.run, generation: moment.generation };
    const pick = (side) => ({ run: team.run, n: nearest_of(player.sides[team.run][side].generations, team.generation) });
    const scene = player.played(pick("predators"), pick("prey"), moment.start);
    const [first, last] = moment.shown, { size, n_predators, n_prey } = data.world.env;
    const nearest = range(n_prey).sort((a, b) => closest(scene.paths, last, a) - closest(scene.paths, last, b))[0];
    const about = scene.paths.at(last, n_predators + nearest);
    new Painter(canvas, data.world.env).paint(scene, last, { trail: last - first, cells: Math.min(size, CLOSE_UP), about });
  });
}

if (player) {
  byId("play").hidden = false;
  player.show({ start: player.eventful() });
}
document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
charts = new Charts(data, player ?? { sides: [], on() {} });
theme(document.documentElement.dataset.theme);
byId("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
window.addEventListener("resize", () => { player?.draw(); });
window.predprey = { data, player, charts, Game, Side, Paths, behavioursOf, fma };
