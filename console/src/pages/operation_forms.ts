import { ItemKind } from "@api/library_item_pb";

/** A field of the form of an operation: an input, or an option of the command line. */
export interface FormField {
  name: string; // as in OperationInput or OperationOption
  label: string;
  isInput?: boolean;
  kind?: ItemKind; // of the library's items that are offered
  required?: boolean;
  choices?: string[];
  isFlag?: boolean;
  preset?: string;
}

export interface OperationForm {
  command: string;
  title: string;
  verb: string;
  outName?: string; // preset of the name of what it writes
  json?: boolean; // its output is read by this page
  fields: FormField[];
}

const RIG: FormField = { name: "rig", label: "Rig", isInput: true, kind: ItemKind.RIG };
const RESULT: FormField = { name: "result", label: "Job", isInput: true, required: true };
const FORMATS = ["glb", "ply", "obj", "usda", "mdd", "pc2", "npz", "jpg", "png", "mp4"];

export const FORMS: OperationForm[] = [
  {
    command: "rig calibrate",
    title: "Calibrate a rig",
    verb: "Calibrate",
    outName: "rig.json",
    fields: [
      { name: "dump", label: "Recording of the target", isInput: true, kind: ItemKind.DUMP, required: true },
      { name: "target", label: "Target (target.json)", isInput: true, required: true },
      { ...RIG, label: "Rig to begin with, if any" },
      { name: "every", label: "One frame in so many" },
      { name: "min-views", label: "Least views of a camera" },
      { name: "frames", label: "Frames, “0003:0010”; empty: all" },
    ],
  },
  {
    command: "rig plan",
    title: "Plan a rig",
    verb: "Plan",
    outName: "plan",
    fields: [
      { ...RIG, label: "Cameras to choose from", required: true },
      { name: "template", label: "Template", isInput: true, kind: ItemKind.TEMPLATE, required: true },
      { name: "motion", label: "How it moves: a job (job:ID); empty: at rest", isInput: true },
      { name: "cameras", label: "Cameras to choose; 0: as few as needed" },
      { name: "views", label: "Cameras that must see a cell" },
      { name: "moments", label: "Frames of the motion; 0: all" },
    ],
  },
  {
    command: "template build",
    title: "Build a template",
    verb: "Build",
    outName: "template",
    fields: [
      { name: "sources", label: "Recording", isInput: true, kind: ItemKind.DUMP, required: true },
      RIG,
      { name: "board", label: "Board", isInput: true, kind: ItemKind.BOARD, required: true },
      { name: "panels", label: "Panels, if there are several", isInput: true },
      { name: "openings", label: "Openings of the garment; −1: do not check" },
      { name: "frames", label: "Frames, “0003:0010”; empty: all" },
    ],
  },
  {
    command: "evaluate",
    title: "Evaluate a registration",
    verb: "Evaluate",
    outName: "evaluation",
    fields: [
      RESULT,
      { name: "against", label: "Compare with the job (job:ID), if with any", isInput: true },
      { name: "truth", label: "Ground truth, if there is any", isInput: true },
      { name: "take", label: "Recording; empty: the job's", isInput: true },
      RIG,
      { name: "template", label: "Template; empty: the job's", isInput: true, kind: ItemKind.TEMPLATE },
      { name: "quick", label: "Quick: fewer samples", isFlag: true },
    ],
  },
  {
    command: "export",
    title: "Export meshes",
    verb: "Export",
    outName: "export",
    fields: [
      RESULT,
      { name: "format", label: "Format", choices: FORMATS, required: true, preset: "glb" },
      { name: "frames", label: "Frames, “0003:0010”; empty: all" },
      { name: "fps", label: "Frames per second" },
      { name: "overlay", label: "Draw over the pictures (jpg, png, mp4)", choices: ["", "wireframe", "state", "sigma"] },
      { name: "camera", label: "Camera of the overlay" },
      { name: "texture", label: "Size of the texture in px" },
      { name: "meshopt", label: "Compressed (glb)", isFlag: true },
      { name: "allow-unfinished", label: "Although frames are missing", isFlag: true },
    ],
  },
  {
    command: "take verify",
    title: "Check a take's bytes",
    verb: "Check",
    fields: [{ name: "take", label: "Take (take:ID)", isInput: true, required: true }],
  },
  {
    command: "take trim",
    title: "Trim a take",
    verb: "Trim",
    fields: [
      { name: "take", label: "Take (take:ID)", isInput: true, required: true },
      { name: "frames", label: "Frames that stay, “0003:0010”", required: true },
    ],
  },
];
