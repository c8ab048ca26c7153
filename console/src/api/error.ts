import { fromJson } from "@bufbuild/protobuf";
import type { JsonValue } from "@bufbuild/protobuf";
import { ConsoleErrorSchema } from "@api/console_pb";

/** What the daemon refused, or why it did not answer. `code` as that of gRPC: "PERMISSION_DENIED". */
export class ApiError extends Error {
  constructor(
    readonly code: string,
    message: string,
    readonly field = "",
    readonly remedy = "",
  ) {
    super(message);
    this.name = "ApiError";
  }
}

export const UNREACHABLE = "UNREACHABLE";

/** The error of a body that is a ConsoleError; null: its code is OK. */
export function errorOf(json: unknown): ApiError | null {
  try {
    const error = fromJson(ConsoleErrorSchema, json as JsonValue, { ignoreUnknownFields: true });
    return error.code === "OK" ? null : new ApiError(error.code, error.message, error.field, error.remedy);
  } catch {
    return new ApiError("UNKNOWN", "the daemon's answer cannot be read");
  }
}

export function asApiError(reason: unknown): ApiError {
  if (reason instanceof ApiError) return reason;
  return new ApiError("UNKNOWN", reason instanceof Error ? reason.message : String(reason));
}
