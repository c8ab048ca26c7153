import type {
  DescMessage,
  DescMethodServerStreaming,
  DescMethodUnary,
  MessageInitShape,
  MessageShape,
} from "@bufbuild/protobuf";
import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { ApiError, asApiError } from "./api/error";
import { client } from "./app_state";

export interface Answer<T> {
  /** The last that arrived; kept while the daemon does not answer. */
  value: T | undefined;
  error: ApiError | null;
  reload: () => void;
}

/** The answer to a request, asked for again every so many ms while the page is looked at; 0: once. */
export function useCall<I extends DescMessage, O extends DescMessage>(
  method: DescMethodUnary<I, O>,
  request: MessageInitShape<I>,
  every_ms = 0,
): Answer<MessageShape<O>> {
  const [value, setValue] = useState<MessageShape<O>>();
  const [error, setError] = useState<ApiError | null>(null);
  const key = JSON.stringify(request);
  const asked = useRef({ key, round: 0 });
  asked.current.key = key;

  const load = useCallback(async () => {
    const round = ++asked.current.round;
    try {
      const answer = await client.call(method, request);
      if (asked.current.round !== round) return;
      setValue(answer);
      setError(null);
    } catch (reason) {
      if (asked.current.round === round) setError(asApiError(reason));
    }
  }, [method, key]);

  const connections = client.live.connections.value;
  useEffect(() => {
    void load();
    const timer = every_ms ? setInterval(() => document.hidden || void load(), every_ms) : 0;
    return () => {
      clearInterval(timer);
      ++asked.current.round;
    };
  }, [load, every_ms, connections]);
  useEffect(() => () => setValue(undefined), [method, key]);
  return { value, error, reload: () => void load() };
}

/** The newest message of a stream. null as request: nothing is watched. */
export function useWatch<I extends DescMessage, O extends DescMessage>(
  method: DescMethodServerStreaming<I, O>,
  request: MessageInitShape<I> | null,
  onMessage?: (message: MessageShape<O>) => void,
): { value: MessageShape<O> | undefined; error: ApiError | null } {
  const [value, setValue] = useState<MessageShape<O>>();
  const [error, setError] = useState<ApiError | null>(null);
  const key = JSON.stringify(request);
  const told = useRef(onMessage);
  told.current = onMessage;
  useEffect(() => {
    setValue(undefined);
    setError(null);
    if (!request) return;
    return client.watch(
      method,
      request,
      (message) => {
        setValue(message);
        told.current?.(message);
      },
      setError,
    );
  }, [method, key]);
  return { value, error };
}

export interface Action {
  busy: boolean;
  error: ApiError | null;
  run: (work: () => Promise<unknown>) => Promise<boolean>;
  clear: () => void;
}

/** Runs what a button asks for: one at a time, with its error. */
export function useAction(): Action {
  const [busy, setBusy] = useState(false);
  const [error, setError] = useState<ApiError | null>(null);
  const run = async (work: () => Promise<unknown>) => {
    if (busy) return false;
    setBusy(true);
    setError(null);
    try {
      await work();
      return true;
    } catch (reason) {
      setError(asApiError(reason));
      return false;
    } finally {
      setBusy(false);
    }
  };
  return { busy, error, run, clear: () => setError(null) };
}

/** 8 to 64 of a-z, 0-9 and "-": a request that is repeated with it is carried out once. */
export function newKey(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(8));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
