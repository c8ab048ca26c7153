import { useId } from "preact/hooks";
import { ItemKind } from "@api/library_item_pb";
import { Library } from "@api/library_pb";
import { useCall } from "../hooks";

/** A path of the daemon's machine, or an item of its library, which is offered. */
export function InputField({ label, kind, value, onChange, required }: { label: string; kind: ItemKind; value: string; onChange: (value: string) => void; required?: boolean }) {
  const id = useId();
  const { value: items } = useCall(Library.method.listItems, { kind });
  const names = new Set((items?.items ?? []).flatMap((item) => item.names.map((name) => `library:${name.name}`)));
  return (
    <label>
      {label}
      <input list={id} value={value} required={required} spellcheck={false} placeholder="library:NAME or a path" onInput={(event) => onChange(event.currentTarget.value)} />
      <datalist id={id}>
        {[...names].map((name) => (
          <option key={name} value={name} />
        ))}
      </datalist>
    </label>
  );
}

export const KINDS: Record<ItemKind, string> = {
  [ItemKind.UNSPECIFIED]: "unknown",
  [ItemKind.RIG]: "rig",
  [ItemKind.BOARD]: "board",
  [ItemKind.TEMPLATE]: "template",
  [ItemKind.DUMP]: "recording",
  [ItemKind.AVATAR]: "avatar",
  [ItemKind.GARMENT]: "garment",
};
