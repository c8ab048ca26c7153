import { useState } from "preact/hooks";
import { Role } from "@api/access_pb";
import { Jobs } from "@api/jobs_pb";
import { ItemKind } from "@api/library_item_pb";
import { Operations } from "@api/operations_pb";
import { OptionType, WorkOut, WorkStart } from "@api/work_pb";
import type { WorkInputInfo, WorkKindInfo, WorkOptionInfo } from "@api/work_pb";
import { client, mayAs } from "../app_state";
import { newKey, useAction, useCall } from "../hooks";
import { go } from "../router";
import { Dialog, FormEnd } from "../ui/dialog";
import { InputField } from "../ui/inputs";
import { Failure, Waiting } from "../ui/parts";

type Values = Record<string, string>;

/** A button for each kind of work that is started so, as the daemon describes them. */
export function StartWork({ start }: { start: WorkStart }) {
  const { value } = useCall(Jobs.method.listWorkKinds, {});
  const [kind, setKind] = useState<WorkKindInfo | null>(null);
  const kinds = (value?.kinds ?? []).filter((one) => one.start === start);
  if (!mayAs(Role.CLIENT) || kinds.length === 0) return null;
  return (
    <>
      <div class="actions">
        {kinds.map((one) => (
          <button type="button" key={one.name} onClick={() => setKind(one)}>
            {one.title}
          </button>
        ))}
      </div>
      {kind && <WorkDialog kind={kind} onClose={() => setKind(null)} />}
    </>
  );
}

const isFlag = (option: WorkOptionInfo) => option.type === OptionType.FLAG;

/** Starts the work, and shows its page. */
async function begin(kind: WorkKindInfo, values: Values, outName: string, key: string): Promise<void> {
  const inputs = kind.inputs.filter(({ name }) => values[name]).map(({ name }) => ({ name, value: values[name]!.trim() }));
  const options = kind.options
    .filter(({ name }) => values[name])
    .map((option) => ({ name: option.name, value: isFlag(option) ? "" : values[option.name]!.trim() }));
  if (kind.start === WorkStart.JOB) {
    const job = await client.call(Jobs.method.submitJob, { spec: { work: { kind: kind.name, inputs, options } }, idempotencyKey: key });
    go("jobs", job.id);
  } else {
    const spec = { command: kind.name, inputs, options, outName };
    go("operations", (await client.call(Operations.method.startOperation, { spec, idempotencyKey: key })).id);
  }
}

/** The form of a kind of work. */
export function WorkDialog({ kind, preset, onClose }: { kind: WorkKindInfo; preset?: Values; onClose: () => void }) {
  const [values, setValues] = useState<Values>(() => ({
    ...Object.fromEntries(kind.options.filter((option) => option.preset).map((option) => [option.name, option.preset])),
    ...preset,
  }));
  const isNamed = kind.start === WorkStart.OPERATION && kind.out === WorkOut.NAMED;
  const [outName, setOutName] = useState(isNamed ? kind.outName : "");
  const [key] = useState(newKey);
  const action = useAction();
  const field = (info: WorkInputInfo | WorkOptionInfo) => ({
    key: info.name,
    value: values[info.name] ?? "",
    onChange: (value: string) => setValues({ ...values, [info.name]: value }),
  });
  const usual = kind.options.filter((option) => !option.isRare);
  const rare = kind.options.filter((option) => option.isRare);
  return (
    <Dialog title={kind.title} onClose={onClose}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void action.run(() => begin(kind, values, outName.trim(), key));
        }}
      >
        <p>{kind.about}</p>
        {kind.inputs.map((input) => (
          <Input {...field(input)} input={input} />
        ))}
        {usual.map((option) => (
          <Option {...field(option)} option={option} />
        ))}
        {rare.length > 0 && (
          <details>
            <summary>More options</summary>
            {rare.map((option) => (
              <Option {...field(option)} option={option} />
            ))}
          </details>
        )}
        {isNamed && (
          <label>
            Name of the result
            <input required value={outName} onInput={(event) => setOutName(event.currentTarget.value)} />
          </label>
        )}
        <FormEnd action={action} verb={kind.verb} onClose={onClose} />
      </form>
    </Dialog>
  );
}

interface Field {
  value: string;
  onChange: (value: string) => void;
}

function Input({ input, value, onChange }: Field & { input: WorkInputInfo }) {
  const { item, label, isRequired } = input;
  if (item !== ItemKind.UNSPECIFIED) return <InputField label={label} kind={item} required={isRequired} value={value} onChange={onChange} />;
  return (
    <label>
      {label}
      <input required={isRequired} spellcheck={false} value={value} onInput={(event) => onChange(event.currentTarget.value)} />
    </label>
  );
}

function Option({ option, value, onChange }: Field & { option: WorkOptionInfo }) {
  const { label, isRequired, choices, least, most } = option;
  if (isFlag(option)) {
    return (
      <label class="check">
        <input type="checkbox" checked={value !== ""} onChange={(event) => onChange(event.currentTarget.checked ? "yes" : "")} />
        {label}
      </label>
    );
  }
  if (choices.length > 0) {
    return (
      <label>
        {label}
        <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
          {[...(isRequired || option.preset ? [] : [""]), ...choices].map((choice) => (
            <option key={choice} value={choice}>
              {choice || "as usual"}
            </option>
          ))}
        </select>
      </label>
    );
  }
  const isNumber = option.type === OptionType.INTEGER || option.type === OptionType.NUMBER;
  const range = isNumber && (least !== 0 || most !== 0) ? { min: least, max: most } : {};
  return (
    <label>
      {label}
      <input
        type={isNumber ? "number" : "text"}
        step={option.type === OptionType.INTEGER ? 1 : "any"}
        {...range}
        required={isRequired}
        spellcheck={false}
        value={value}
        onInput={(event) => onChange(event.currentTarget.value)}
      />
    </label>
  );
}

/** The dialog of an operation on the results of a job. */
export function OfJobDialog({ name, jobId, onClose }: { name: "export" | "evaluate"; jobId: string; onClose: () => void }) {
  const { value, error } = useCall(Jobs.method.listWorkKinds, {});
  const kind = value?.kinds.find((one) => one.name === name);
  if (kind) return <WorkDialog kind={kind} preset={{ result: `job:${jobId}` }} onClose={onClose} />;
  return error ? <Failure error={error} /> : <Waiting for="the form" />;
}
