import { useState } from "preact/hooks";
import { logIn, loggedOutBecause } from "./app_state";
import { useAction } from "./hooks";
import { Failure } from "./ui/parts";

/** Exchanges a token for the browser's cookie. The token is kept nowhere. */
export function Login() {
  const [token, setToken] = useState("");
  const action = useAction();
  return (
    <main class="login" id="main">
      <form
        onSubmit={async (event) => {
          event.preventDefault();
          if (await action.run(() => logIn(token.trim()))) setToken("");
        }}
      >
        <h1>Weft</h1>
        <p>
          {loggedOutBecause.value ||
            "Show your token once. The person who runs the daemon makes one with “weft access token NAME --role ROLE”."}
        </p>
        <label>
          Token
          <input
            type="password"
            name="token"
            autoComplete="current-password"
            required
            autofocus
            value={token}
            onInput={(event) => setToken(event.currentTarget.value)}
          />
        </label>
        <Failure error={action.error} what={action.error?.code === "UNAUTHENTICATED" ? "This token lets nobody in" : undefined} />
        <button class="main" disabled={action.busy}>
          Log in
        </button>
      </form>
    </main>
  );
}
