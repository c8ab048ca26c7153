import { create, fromJson, toJsonString } from "@bufbuild/protobuf";
import type {
  DescMessage,
  DescMethodServerStreaming,
  DescMethodUnary,
  JsonValue,
  MessageInitShape,
  MessageShape,
} from "@bufbuild/protobuf";
import { ConsoleLoginSchema, ConsoleUserSchema } from "@api/console_pb";
import type { ConsoleUser } from "@api/console_pb";
import { ApiError, UNREACHABLE, errorOf } from "./error";
import { LiveSocket } from "./live";

const READ = { ignoreUnknownFields: true };
const TYPE = { "Content-Type": "application/json" };

/** The API of the daemon that served the page, beside which all addresses lie, as the user who is logged in. All its errors are ApiErrors. */
export class Client {
  readonly live = new LiveSocket();

  async logIn(token: string): Promise<ConsoleUser> {
    const body = toJsonString(ConsoleLoginSchema, create(ConsoleLoginSchema, { token }));
    return fromJson(ConsoleUserSchema, await ask("login", { method: "POST", headers: TYPE, body }), READ);
  }

  async logOut(): Promise<void> {
    await ask("logout", { method: "POST", headers: TYPE, body: "{}" });
  }

  /** Who the browser's cookie belongs to. UNAUTHENTICATED: nobody. */
  async user(): Promise<ConsoleUser> {
    return fromJson(ConsoleUserSchema, await ask("session", {}), READ);
  }

  async call<I extends DescMessage, O extends DescMessage>(
    method: DescMethodUnary<I, O>,
    request: MessageInitShape<I>,
  ): Promise<MessageShape<O>> {
    const body = toJsonString(method.input, create(method.input, request));
    const path = `api/${method.parent.name}/${method.name}`;
    return fromJson(method.output, await ask(path, { method: "POST", headers: TYPE, body }), READ);
  }

  /** The messages of a stream as they come; asked for again when a connection was lost. Returns what ends it. */
  watch<I extends DescMessage, O extends DescMessage>(
    method: DescMethodServerStreaming<I, O>,
    request: MessageInitShape<I>,
    onMessage: (message: MessageShape<O>) => void,
    onEnd: (error: ApiError | null) => void = () => {},
  ): () => void {
    return this.live.watch({
      method: `${method.parent.name}.${method.name}`,
      json: toJsonString(method.input, create(method.input, request)),
      onMessage: (json) => onMessage(fromJson(method.output, json as JsonValue, READ)),
      onEnd,
    });
  }

  /** Address of a file that a method sends; `query` are the request's fields as the schema names them. */
  fileUrl(method: { parent: { name: string }; name: string }, query: Record<string, string>): string {
    return `file/${method.parent.name}/${method.name}?${new URLSearchParams(query)}`;
  }

  /** The bytes of such a file. */
  async file(
    method: { parent: { name: string }; name: string },
    query: Record<string, string>,
    signal?: AbortSignal,
  ): Promise<ArrayBuffer> {
    const response = await send(this.fileUrl(method, query), { signal });
    if (!response.ok) throw await errorIn(response);
    return response.arrayBuffer();
  }

  /** The mesh of a job's frame, as services/server/console/quantized_mesh.h says; without faces unless they are asked for. */
  async mesh(jobId: string, frame: string, name: string, withFaces: boolean, signal?: AbortSignal): Promise<ArrayBuffer> {
    const query = new URLSearchParams({ ...(name && { mesh: name }), ...(withFaces && { faces: "1" }) }).toString();
    const response = await send(`mesh/${[jobId, frame].map(encodeURIComponent).join("/")}${query && `?${query}`}`, { signal });
    if (!response.ok) throw await errorIn(response);
    return response.arrayBuffer();
  }
}

async function send(path: string, init: RequestInit): Promise<Response> {
  try {
    return await fetch(path, { credentials: "same-origin", redirect: "error", ...init });
  } catch (reason) {
    if (reason instanceof DOMException && reason.name === "AbortError") throw reason;
    throw new ApiError(UNREACHABLE, "the daemon does not answer", "", "look whether weftd runs and the network holds");
  }
}

async function errorIn(response: Response): Promise<ApiError> {
  const json: unknown = await response.json().catch(() => null);
  const error = errorOf(json);
  return error ?? new ApiError("UNKNOWN", `the daemon answered ${response.status}`);
}

async function ask(path: string, init: RequestInit): Promise<JsonValue> {
  const response = await send(path, init);
  if (!response.ok) throw await errorIn(response);
  return (await response.json()) as JsonValue;
}
