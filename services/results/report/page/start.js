// @ts-check
// The last file of the program.
import { startPage } from "./parts.js";

startPage();
