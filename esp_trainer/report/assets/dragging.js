// Dragging of agents. The current cells become the new start, with the agent where it is dropped.

// player: the Player. hover: called with the agent under the mouse, or -1.
function letDrag(player, hover) {
  const { painter, env } = player, { canvas } = painter;
  canvas.style.cursor = "grab";
  let cells = null, held = -1, moved = false, under = -1;
  const cellOf = (event) => {
    const box = canvas.getBoundingClientRect();
    return painter.cellAt(event.clientX - box.left, event.clientY - box.top);
  };
  const here = () => player.match.cells[Math.floor(player.time)];
  // Return the agent at a pointer, or -1.
  const agentAt = (event) => {
    const at = cellOf(event), along = (cell, axis) => displacement(at[axis], cell[axis], env.size);
    const away = here().map((cell) => Math.hypot(along(cell, 0), along(cell, 1))), nearest = away.indexOf(Math.min(...away));
    return away[nearest] > Math.max(1, (3 * painter.radius) / painter.scale) ? -1 : nearest;
  };
  const overAgent = (agent) => {
    if (agent === under) return;
    under = agent;
    hover(agent);
  };
  canvas.addEventListener("pointerdown", (event) => {
    held = player.live ? -1 : agentAt(event);
    if (held < 0) return;
    player.pause();
    cells = here().map((cell) => [...cell]);
    moved = false;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (held < 0 && event.pointerType === "mouse" && !player.live) overAgent(agentAt(event));
    if (held < 0) return;
    const at = cellOf(event);
    if (at[0] === cells[held][0] && at[1] === cells[held][1]) return;
    cells[held] = at;
    moved = true;
    player.show({ start: cells.map((cell) => [...cell]) });
  });
  canvas.addEventListener("pointerleave", () => overAgent(-1));
  canvas.addEventListener("pointerup", () => {
    if (held >= 0 && !moved) player.agent = held;
    held = -1;
    player.draw();
  });
  canvas.addEventListener("pointercancel", () => { held = -1; });
  // A finger on an agent drags it; elsewhere it scrolls the page.
  canvas.addEventListener("touchstart", (event) => { if (held >= 0) event.preventDefault(); }, { passive: false });
}
