/** What keys turn and zoom. */
export interface Turning {
  turn(right_deg: number, up_deg: number, nearer?: number): void;
  reset(): void;
}

const TURN_DEG = 10;
const ZOOM = 1.15;

export function turnByKey(view: Turning, event: KeyboardEvent): void {
  const turns: Record<string, () => void> = {
    ArrowLeft: () => view.turn(-TURN_DEG, 0),
    ArrowRight: () => view.turn(TURN_DEG, 0),
    ArrowUp: () => view.turn(0, TURN_DEG),
    ArrowDown: () => view.turn(0, -TURN_DEG),
    "+": () => view.turn(0, 0, ZOOM),
    "-": () => view.turn(0, 0, 1 / ZOOM),
    "0": () => view.reset(),
  };
  const turn = turns[event.key];
  if (!turn || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  turn();
}
