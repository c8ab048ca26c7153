import { bytesText } from "./format";
import { Table } from "./parts";

/** Files of a result or an item, each to be saved; with `opens`, what a browser shows opens in a tab of its own. */
export function FileTable({
  files,
  url,
  opens,
}: {
  files: { path: string; bytes: bigint }[];
  url: (path: string, more?: Record<string, string>) => string;
  opens?: boolean;
}) {
  return (
    <Table label="Files" head={["file", "size", ""]}>
      {files.map((file) => (
        <tr key={file.path}>
          <td>
            {opens && /\.(html|png|jpg|svg|txt|csv|json)$/.test(file.path) ? (
              <a class="row" target="_blank" rel="noopener" href={url(file.path)}>
                {file.path}
              </a>
            ) : (
              file.path
            )}
          </td>
          <td class="number">{bytesText(file.bytes)}</td>
          <td>
            <a href={url(file.path, { save_as: file.path.split("/").at(-1)! })} aria-label={`Save ${file.path}`}>
              Save
            </a>
          </td>
        </tr>
      ))}
    </Table>
  );
}
