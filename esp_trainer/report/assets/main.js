// Start-up of the page.

const data = JSON.parse(byId("data").textContent);
const playable = data.runs.some((run) => run.sides) && data.starts.length > 0;
let charts = null;
const player = playable ? new Player(data, chosen) : null;
const CLOSE_UP = 50; // side of the picture of a moment, in cells
const LONG = 30; // maximum number of steps of a lasting behaviour to show
const pictures = player ? data.moments.map(pictured) : [];

// Follow the player to another match.
function chosen() {
  charts?.mark();
  if (player.match.steered < 0) player.yourself?.invite();
}

// Add a picture of a moment, in a button that plays it.
function pictured(moment) {
  const canvas = element("canvas"), team = { run: moment.run, generation: moment.generation };
  const where = `${data.runs.length > 1 ? `${data.runs[moment.run].name}, ` : ""}generation ${moment.generation}, step ${moment.step}`;
  const button = element("button", { type: "button" }, [canvas, element("strong", { textContent: moment.title }),
    element("small", { textContent: moment.text }), element("small", { textContent: where })]);
  button.addEventListener("click", () => {
    player.show({ predators: team, prey: team, start: moment.start, name: "of this moment", step: moment.shown[0] });
    byId("toggle").focus({ preventScroll: true }); // otherwise space would press the moment's button again
    bring(byId("play"));
    player.play();
  });
  byId("moments").hidden = false;
  document.querySelector(".moments").append(button);
  const pick = (side) => player.pick(side, team);
  const scene = player.played(pick("predators"), pick("prey"), moment.start);
  return { moment, scene, painter: new Painter(canvas, data.world.env) };
}

// Draw the picture of a moment, centred on the prey that is nearest to a predator. A behaviour that lasts is shown while
// it lasts. One that is over at once is shown at the last of the shown steps, when its result is visible.
function paint({ moment: { step, until, shown }, scene, painter }) {
  const { size, n_predators, n_prey } = data.world.env, chosen = until > step ? Math.min(until, step + LONG) : shown[1];
  const time = Math.min(chosen, scene.match.length);
  const closest = (prey) => nearest_distance(scene.episode, time, prey);
  const [prey] = range(n_prey).sort((a, b) => closest(a) - closest(b));
  const about = scene.episode.cells[time][n_predators + prey];
  painter.paint(scene, time, { trail: time - shown[0], cells: Math.min(size, CLOSE_UP), about });
}

function draw() {
  player?.draw();
  player?.thoughts?.hover(-1);
  pictures.forEach(paint);
}

// Hide what needs computed matches, and say what can be chosen instead.
function showAsRecorded() {
  for (const place of document.querySelectorAll(".computed")) place.hidden = true;
  const most = Math.max(...player.sides.flatMap((run) => (run ? [run.predators, run.prey] : [])).map((side) => side.generations.length));
  const runs = data.runs.length > 1 ? " Both sides are of the same run." : "";
  byId("recorded").textContent = `These matches are recorded, for ${counted(most, "generation")} of a side and ` +
    `${counted(data.starts.length, "start")}. If another is asked for, the nearest is shown.${runs}`;
  byId("recorded").hidden = false;
  byId("matrix-click").textContent = "A click on a cell plays the nearest recorded match.";
}

function theme(name) {
  document.documentElement.dataset.theme = name;
  charts.draw();
  draw();
}

let linked = false;
if (!player) {
  document.querySelector(".charts").before(byId("matrix-figure")); // it needs no player
  byId("matrix-click").remove();
}
if (player) {
  byId("play").hidden = false;
  player.show({ start: player.eventful() });
  listenToKeys(player);
  if (player.recording) showAsRecorded();
  else {
    letDrag(player, (agent) => player.thoughts.hover(agent));
    player.yourself = new Yourself(player, data.world.moves);
  }
  linked = followLinks(player, byId("link"), byId("linked"));
}
charts = new Charts(data, player);
theme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
byId("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
window.addEventListener("resize", draw);
new Tour(byId("take-tour"), data.world ? STEPS : STEPS_OF_GAME, () => player?.seek(Math.floor(player.match.length / 2)));
if (player && !linked && !calm()) player.play(3);
window.predprey = { data, player, charts, Game, Episode, Side, behavioursOf, csvOfChart, fma };
