import { useState } from "preact/hooks";
import { Operations } from "@api/operations_pb";
import type { Operation } from "@api/operations_pb";
import { client } from "../app_state";
import { newKey, useAction } from "../hooks";
import { go } from "../router";
import { Dialog, FormEnd } from "../ui/dialog";
import { InputField } from "../ui/inputs";
import { FORMS } from "./operation_forms";
import type { FormField, OperationForm } from "./operation_forms";

type Values = Record<string, string>;

function start(form: OperationForm, values: Values, outName: string, key: string): Promise<Operation> {
  const given = form.fields.filter((field) => values[field.name]);
  return client.call(Operations.method.startOperation, {
    spec: {
      command: form.command,
      inputs: given.filter((field) => field.isInput).map(({ name }) => ({ name, value: values[name]!.trim() })),
      options: given.filter((field) => !field.isInput).map((field) => ({ name: field.name, value: field.isFlag ? "" : values[field.name]!.trim() })),
      outName,
      json: form.json ?? false,
    },
    idempotencyKey: key,
  });
}

/** The form of an operation; what is started is shown on its page. */
export function OperationDialog({ form, preset, onClose }: { form: OperationForm; preset?: Values; onClose: () => void }) {
  const [values, setValues] = useState<Values>(() => ({
    ...Object.fromEntries(form.fields.flatMap(({ name, preset: value }) => (value ? [[name, value]] : []))),
    ...preset,
  }));
  const [outName, setOutName] = useState(form.outName ?? "");
  const [key] = useState(newKey);
  const action = useAction();
  const set = (name: string) => (value: string) => setValues({ ...values, [name]: value });
  return (
    <Dialog title={form.title} onClose={onClose}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void action.run(async () => go("operations", (await start(form, values, outName.trim(), key)).id));
        }}
      >
        {form.fields.map((field) => (
          <Field key={field.name} field={field} value={values[field.name] ?? ""} onChange={set(field.name)} />
        ))}
        {form.outName && (
          <label>
            Name of the result
            <input required value={outName} onInput={(event) => setOutName(event.currentTarget.value)} />
          </label>
        )}
        <FormEnd action={action} verb={form.verb} onClose={onClose} />
      </form>
    </Dialog>
  );
}

function Field({ field, value, onChange }: { field: FormField; value: string; onChange: (value: string) => void }) {
  if (field.isFlag) {
    return (
      <label class="check">
        <input type="checkbox" checked={value !== ""} onChange={(event) => onChange(event.currentTarget.checked ? "yes" : "")} />
        {field.label}
      </label>
    );
  }
  if (field.kind !== undefined) return <InputField label={field.label} kind={field.kind} required={field.required} value={value} onChange={onChange} />;
  return (
    <label>
      {field.label}
      {field.choices ? (
        <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
          {field.choices.map((choice) => (
            <option key={choice} value={choice}>
              {choice || "nothing"}
            </option>
          ))}
        </select>
      ) : (
        <input required={field.required} spellcheck={false} value={value} onInput={(event) => onChange(event.currentTarget.value)} />
      )}
    </label>
  );
}

const formOf = (command: string) => FORMS.find((form) => form.command === command)!;

export function ExportDialog({ jobId, onClose }: { jobId: string; onClose: () => void }) {
  return <OperationDialog form={formOf("export")} preset={{ result: `job:${jobId}` }} onClose={onClose} />;
}

export function EvaluateDialog({ jobId, onClose }: { jobId: string; onClose: () => void }) {
  return <OperationDialog form={formOf("evaluate")} preset={{ result: `job:${jobId}` }} onClose={onClose} />;
}
