import { render } from "preact";
import { App } from "./app";
import { startState } from "./app_state";
import { renewFromNowOn } from "./cameras/leases";
import { startKeys } from "./keys";
import { startRouter } from "./router";
import "./style.css";

startRouter();
startKeys();
startState();
renewFromNowOn();
render(<App />, document.getElementById("console")!);
