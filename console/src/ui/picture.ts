/** An address for the bytes of a JPEG; revoke it once it was loaded. */
export function pictureUrl(jpeg: Uint8Array): string {
  return URL.createObjectURL(new Blob([jpeg as Uint8Array<ArrayBuffer>], { type: "image/jpeg" }));
}
