import type { ComponentChildren } from "preact";
import { useEffect, useId, useRef } from "preact/hooks";
import { useAction } from "../hooks";
import type { Action } from "../hooks";
import { Failure } from "./parts";

/** A modal dialog by the browser's own element, which keeps the focus within and closes at Escape. */
export function Dialog({ title, onClose, children, wide }: { title: string; onClose: () => void; children: ComponentChildren; wide?: boolean }) {
  const dialog = useRef<HTMLDialogElement>(null);
  const id = useId();
  useEffect(() => {
    dialog.current?.showModal();
  }, []);
  return (
    <dialog ref={dialog} class={wide ? "wide" : ""} aria-labelledby={id} onClose={onClose}>
      <header>
        <h2 id={id}>{title}</h2>
        <button type="button" class="plain" aria-label="Close" onClick={() => dialog.current?.close()}>
          ✕
        </button>
      </header>
      {children}
    </dialog>
  );
}

/** The end of a form in a dialog: what went wrong, a way out, and the button that submits it. */
export function FormEnd({ action, verb, onClose, disabled }: { action: Action; verb: string; onClose: () => void; disabled?: boolean }) {
  return (
    <>
      <Failure error={action.error} />
      <div class="actions end">
        <button type="button" onClick={onClose}>
          Close
        </button>
        <button class="main" disabled={action.busy || disabled}>
          {verb}
        </button>
      </div>
    </>
  );
}

export interface Question {
  title: string;
  text: ComponentChildren;
  verb: string; // on the button: "Delete"
  isGrave?: boolean; // what it does is not undone by a click
  run: () => Promise<unknown>;
}

/** Asks before something is done, and stays with the error if it could not be. */
export function Ask({ question, onClose }: { question: Question; onClose: () => void }) {
  const action = useAction();
  return (
    <Dialog title={question.title} onClose={onClose}>
      <div>{question.text}</div>
      <Failure error={action.error} />
      <div class="actions end">
        <button type="button" autofocus onClick={onClose}>
          Keep
        </button>
        <button
          type="button"
          class={question.isGrave ? "grave" : "main"}
          disabled={action.busy}
          onClick={async () => (await action.run(question.run)) && onClose()}
        >
          {question.verb}
        </button>
      </div>
    </Dialog>
  );
}
