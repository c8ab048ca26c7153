import { useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { ItemKind } from "@api/library_item_pb";
import type { LibraryItem } from "@api/library_item_pb";
import { Library } from "@api/library_pb";
import { client, mayAs } from "../app_state";
import { useCall } from "../hooks";
import { hrefOf, route } from "../router";
import { Ask } from "../ui/dialog";
import type { Question } from "../ui/dialog";
import { FileTable } from "../ui/file_table";
import { bytesText, timeText } from "../ui/format";
import { InThreeD } from "../ui/in_three_d";
import { KINDS } from "../ui/inputs";
import { Facts, Failure, Page, Table, Waiting, Warnings } from "../ui/parts";

// As the API names them in queries.
const KIND_NAMES: Record<ItemKind, string> = {
  [ItemKind.UNSPECIFIED]: "ITEM_KIND_UNSPECIFIED",
  [ItemKind.RIG]: "ITEM_KIND_RIG",
  [ItemKind.BOARD]: "ITEM_KIND_BOARD",
  [ItemKind.TEMPLATE]: "ITEM_KIND_TEMPLATE",
  [ItemKind.DUMP]: "ITEM_KIND_DUMP",
  [ItemKind.AVATAR]: "ITEM_KIND_AVATAR",
  [ItemKind.GARMENT]: "ITEM_KIND_GARMENT",
};

export function LibraryPage() {
  const [, kind, id] = route.value;
  return kind && id ? <ItemPage key={id} kind={Number(kind)} id={id} /> : <ItemList />;
}

function namesOf(item: LibraryItem): string {
  return item.names.map((name) => `${name.name}@${name.version}`).join(", ") || item.id.slice(0, 12);
}

function ItemList() {
  const { value, error, reload } = useCall(Library.method.listItems, {}, 5000);
  const [question, setQuestion] = useState<Question | null>(null);
  const remove = (item: LibraryItem) =>
    setQuestion({
      title: `Delete ${namesOf(item)}?`,
      text: <p>The {KINDS[item.kind]} is removed for good, with all its names. Jobs that used it keep their results.</p>,
      verb: "Delete for good",
      isGrave: true,
      run: () => client.call(Library.method.deleteItem, { kind: item.kind, item: `sha256:${item.id}` }).then(reload),
    });
  return (
    <Page title="Library">
      <Failure error={error} />
      <Warnings texts={value?.damaged} />
      {!value && !error && <Waiting for="the library" />}
      {value && value.items.length === 0 && <p class="empty">Nothing yet. “weft library upload” brings rigs, boards, templates and recordings here.</p>}
      {value && value.items.length > 0 && (
        <Table label="Items" head={["name", "what", "files", "size", "since", ""]}>
          {value.items.map((item) => (
            <tr key={KINDS[item.kind] + item.id}>
              <td>
                <a class="row" href={hrefOf("library", String(item.kind), item.id)}>
                  {namesOf(item)}
                </a>
              </td>
              <td>{KINDS[item.kind]}</td>
              <td class="number">{item.fileCount}</td>
              <td class="number">{bytesText(item.bytes)}</td>
              <td class="number">{timeText(item.names[0]?.createdUnixNs ?? 0n)}</td>
              <td class="actions end">
                {mayAs(Role.OPERATOR) && (
                  <button type="button" aria-label={`Delete ${namesOf(item)}`} onClick={() => remove(item)}>
                    Delete
                  </button>
                )}
              </td>
            </tr>
          ))}
        </Table>
      )}
      {question && <Ask question={question} onClose={() => setQuestion(null)} />}
    </Page>
  );
}

const PICTURE = /\.(png|jpg)$/;

function ItemPage({ kind, id }: { kind: ItemKind; id: string }) {
  const { value: item, error } = useCall(Library.method.getItem, { kind, item: `sha256:${id}` });
  if (!item) return error ? <Failure error={error} /> : <Waiting for="the item" />;
  const files = item.manifest?.files ?? [];
  const url = (path: string, more: Record<string, string> = {}) =>
    client.fileUrl(Library.method.fetchFile, { kind: KIND_NAMES[kind], item: `sha256:${id}`, path, ...more });
  const picture = kind === ItemKind.BOARD ? files.find((file) => PICTURE.test(file.path)) : undefined;
  return (
    <Page title={namesOf(item)}>
      <Facts
        facts={[
          ["What", KINDS[item.kind]],
          ["Size", bytesText(item.bytes)],
          ["Named in jobs", item.names.map((name) => <code key={name.name}>library:{name.name}@{name.version} </code>)],
          ["Content", <code>{item.id}</code>],
        ]}
      />
      {kind === ItemKind.RIG && <InThreeD mount={(player, element) => player.mountRig(element, client, id)} />}
      {kind === ItemKind.TEMPLATE && <InThreeD mount={(player, element) => player.mountTemplate(element, client, id)} />}
      {kind === ItemKind.GARMENT && (
        <InThreeD mount={(player, element) => player.mountGarment(element, client, id, files.map((file) => file.path))} />
      )}
      {picture && <img class="item-picture" src={url(picture.path)} alt={`The board, ${picture.path}`} />}
      <FileTable files={files.slice(0, 500)} url={url} />
      {files.length > 500 && <p class="empty">{files.length - 500} more files are not listed.</p>}
    </Page>
  );
}
