// Keys of the player: space plays and pauses, arrows step, Home and End lead to the first and last step.

function listenToKeys(player) {
  document.addEventListener("keydown", (event) => {
    const { key, target } = event;
    // Outside the player, Home and End scroll the page: it is long, and no label mentions these keys.
    const pages = ["Home", "End"].includes(key) && !target.closest("#play");
    const focused = target.closest("button, summary, a") ? key === " " : target.closest("input") ? key !== " " : target.closest("select");
    const modified = event.ctrlKey || event.metaKey || event.altKey || event.shiftKey;
    if (modified || pages || focused || player.live || !inView(document.querySelector(".stage"))) return;
    const keys = {
      " ": () => event.repeat || (player.playing ? player.pause() : player.play()),
      ArrowLeft: () => player.seek(Math.ceil(player.time) - 1),
      ArrowRight: () => player.seek(Math.floor(player.time) + 1),
      Home: () => player.seek(0),
      End: () => player.seek(player.match.length),
    };
    if (!keys[key]) return;
    event.preventDefault();
    keys[key]();
  });
}

// Return whether any part of an element is visible. If the player is not, keys act on the page: space scrolls it.
function inView(place) {
  const { top, bottom } = place.getBoundingClientRect();
  return bottom > 0 && top < window.innerHeight;
}
