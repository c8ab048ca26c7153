import { signal } from "@preact/signals";
import { ApiError, errorOf } from "./error";

/** One stream over the page's socket. */
export interface Order {
  method: string; // "Takes.WatchTake"
  json: string; // the request
  onMessage: (json: unknown) => void;
  onEnd: (error: ApiError | null) => void;
}

export type Connection = "closed" | "connecting" | "open" | "lost";

const SILENCE_MS = 13_000; // the daemon beats every 5 s
const FIRST_PAUSE_MS = 400;
const LONGEST_PAUSE_MS = 8_000;
const RETRY_MS = 2_000;

/**
 * The page's one connection for all that it watches (services/server/console/live_socket.h). It connects again by itself and
 * then asks again for every stream that had not ended. Times are in ms.
 */
export class LiveSocket {
  readonly state = signal<Connection>("closed");
  /** How often it was connected: whoever read a list reads it again when this grows. */
  readonly connections = signal(0);
  /** Called when a connection could not be made or was ended by the daemon: the session may be over. */
  onRefused: () => void = () => {};

  private socket: WebSocket | null = null;
  private readonly orders = new Map<number, Order>();
  private readonly pauses = new Set<ReturnType<typeof setTimeout>>();
  private lastId = 0;
  private pauseMs = FIRST_PAUSE_MS;
  private wanted = false;
  private reconnect: ReturnType<typeof setTimeout> | undefined;
  private silence: ReturnType<typeof setTimeout> | undefined;

  open(): void {
    if (this.wanted) return;
    this.wanted = true;
    this.connect();
  }

  close(): void {
    this.wanted = false;
    clearTimeout(this.reconnect);
    clearTimeout(this.silence);
    this.pauses.forEach(clearTimeout);
    this.pauses.clear();
    this.socket?.close();
    this.socket = null;
    this.orders.clear();
    this.state.value = "closed";
  }

  /** Connects at once instead of after a pause. */
  retryNow(): void {
    if (!this.wanted || this.state.value !== "lost") return;
    clearTimeout(this.reconnect);
    this.connect();
  }

  watch(order: Order): () => void {
    const id = ++this.lastId;
    this.orders.set(id, order);
    this.say(id, order);
    return () => {
      if (this.orders.delete(id)) this.send(`${id} cancel`);
    };
  }

  private connect(): void {
    this.state.value = this.connections.value > 0 ? "lost" : "connecting";
    const address = new URL("live", document.baseURI);
    address.protocol = address.protocol.replace("http", "ws");
    address.hash = "";
    const socket = new WebSocket(address);
    this.socket = socket;
    socket.onopen = () => {
      this.pauseMs = FIRST_PAUSE_MS;
      this.state.value = "open";
      this.connections.value += 1;
      this.orders.forEach((order, id) => this.say(id, order));
      this.heard();
    };
    socket.onmessage = (event) => {
      this.heard();
      if (typeof event.data === "string") this.read(event.data);
    };
    socket.onclose = () => {
      if (this.socket === socket) this.lost();
    };
    this.heard();
  }

  private lost(): void {
    clearTimeout(this.silence);
    this.socket = null;
    if (!this.wanted) return;
    this.state.value = "lost";
    this.onRefused();
    // Not all pages of a studio at once.
    const pause = this.pauseMs * (0.75 + Math.random() / 2);
    this.pauseMs = Math.min(2 * this.pauseMs, LONGEST_PAUSE_MS);
    this.reconnect = setTimeout(() => this.connect(), pause);
  }

  private heard(): void {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => {
      const socket = this.socket;
      this.lost();
      socket?.close();
    }, SILENCE_MS);
  }

  private say(id: number, order: Order): void {
    this.send(`${id} ${order.method}\n${order.json}`);
  }

  private send(text: string): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }

  private read(text: string): void {
    const line = text.indexOf("\n");
    const [number, kind] = text.slice(0, line).split(" ");
    const id = Number(number);
    const order = this.orders.get(id);
    if (!order) return; // a beat, or what was cancelled meanwhile
    const json: unknown = JSON.parse(text.slice(line + 1));
    if (kind === "message") {
      order.onMessage(json);
    } else if (kind === "end") {
      this.ended(id, order, errorOf(json));
    }
  }

  private ended(id: number, order: Order, error: ApiError | null): void {
    if (error?.code !== "UNAVAILABLE") {
      this.orders.delete(id);
      order.onEnd(error);
      return;
    }
    const pause = setTimeout(() => {
      this.pauses.delete(pause);
      if (this.orders.has(id)) this.say(id, order);
    }, RETRY_MS);
    this.pauses.add(pause);
  }
}
