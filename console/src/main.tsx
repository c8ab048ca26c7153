import { render } from "preact";
import { App } from "./app";
import { startState } from "./app_state";
import { startKeys } from "./keys";
import { startRouter } from "./router";
import "./style.css";

startRouter();
startKeys();
startState();
render(<App />, document.getElementById("console")!);
