// Camera moves from pointer, wheel and keys, collected until the next frame takes them.

const TURN = 0.006;
const KEYS = {
  ArrowLeft: { turn: [-0.05, 0] },
  ArrowRight: { turn: [0.05, 0] },
  ArrowUp: { turn: [0, 0.05] },
  ArrowDown: { turn: [0, -0.05] },
  w: { fly: [0.03, 0, 0] },
  s: { fly: [-0.03, 0, 0] },
  a: { fly: [0, -0.03, 0] },
  d: { fly: [0, 0.03, 0] },
  e: { fly: [0, 0, 0.03] },
  q: { fly: [0, 0, -0.03] },
  "+": { dolly: 0.1 },
  "-": { dolly: -0.1 },
  Home: "reset",
};

export class Camera {
  #moves = [];
  #pointers = new Map();
  onmove = () => {};

  constructor(canvas) {
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#pointers.set(event.pointerId, event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.#pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (event) => this.#drag(event, canvas));
    canvas.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        this.#add({ dolly: -event.deltaY * (event.deltaMode ? 0.03 : 0.001) });
      },
      { passive: false },
    );
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("keydown", (event) => {
      const move = KEYS[event.key] ?? KEYS[event.key.toLowerCase()];
      if (!move || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.#add(move);
    });
  }

  #drag(event, canvas) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    this.#pointers.set(event.pointerId, event);
    const [x, y] = [event.clientX - before.clientX, event.clientY - before.clientY];
    const height = canvas.clientHeight;
    if (this.#pointers.size > 1) {
      const [other] = [...this.#pointers].filter(([id]) => id !== event.pointerId);
      const apart = (of) => Math.hypot(of.clientX - other[1].clientX, of.clientY - other[1].clientY);
      this.#add({ dolly: Math.log(Math.max(apart(event), 1) / Math.max(apart(before), 1)) });
      this.#add({ pan: [-x / height / 2, y / height / 2] });
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) {
      this.#add({ pan: [-x / height, y / height] });
    } else {
      this.#add({ turn: [x * TURN, -y * TURN] });
    }
  }

  #add(move) {
    this.#moves.push(move);
    this.onmove();
  }

  add(move) {
    this.#add(move);
  }

  // Takes the moves since the last frame.
  take() {
    const moves = this.#moves;
    this.#moves = [];
    return moves;
  }

  get isMoving() {
    return this.#moves.length > 0;
  }
}
