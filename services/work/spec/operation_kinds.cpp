// Operations: commands of `weft` that a daemon runs for its clients. No option of theirs names a file.
#include "services/work/spec/kind_texts.h"

namespace weft {

const char* const kOperationKinds[9] = {
    R"info(
name: "rig calibrate" title: "Calibrate a rig" verb: "Calibrate" out: WORK_OUT_NAMED out_name: "rig.json"
about: "Cameras from a recording of a target."
inputs { name: "dump" label: "Recording of the target" item: ITEM_KIND_DUMP is_required: true is_positional: true }
inputs { name: "target" label: "Target (target.json)" is_required: true }
inputs { name: "rig" label: "Rig to begin with, if any" item: ITEM_KIND_RIG }
options { name: "every" label: "One frame in so many" type: OPTION_TYPE_INTEGER least: 1 most: 10000 }
options { name: "min-views" label: "Least views of a camera" type: OPTION_TYPE_INTEGER least: 3 most: 10000 }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "id" label: "Name of the rig" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "mosaic" label: "Mosaic of grey images, “bayer_rg8”" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-frame" label: "Frame whose board is the world" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-board" label: "Which of the boards" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-floor" label: "That board lies on the floor, face up" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "scale" label: "Scale from" type: OPTION_TYPE_TEXT choices: "tags" choices: "bar" is_rare: true }
options { name: "gamma" label: "Gamma of the images" type: OPTION_TYPE_NUMBER least: 0.3 most: 4 is_rare: true }
options { name: "max-blur-px" label: "Widest edges of tags, in px" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "max-rms-px" label: "Largest error of a camera, in px" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "max-stage-sigma-px" label: "Largest uncertainty on the stage, in px" type: OPTION_TYPE_NUMBER is_rare: true }
)info",
    R"info(
name: "rig plan" title: "Plan a rig" verb: "Plan" out: WORK_OUT_NAMED out_name: "plan"
about: "Which cameras see a garment, before they are bought."
inputs { name: "rig" label: "Cameras to choose from" item: ITEM_KIND_RIG is_required: true }
inputs { name: "template" label: "Template" item: ITEM_KIND_TEMPLATE is_required: true }
inputs { name: "motion" label: "How it moves: a job (job:ID); empty: at rest" }
options { name: "cameras" label: "Cameras to choose; 0: as few as needed" type: OPTION_TYPE_INTEGER }
options { name: "views" label: "Cameras that must see a cell" type: OPTION_TYPE_INTEGER least: 2 most: 100 }
options { name: "moments" label: "Frames of the motion; 0: all" type: OPTION_TYPE_INTEGER }
options { name: "max-facing-deg" label: "A cell is seen within this angle, in degrees" type: OPTION_TYPE_NUMBER least: 1 most: 89 is_rare: true }
options { name: "min-pitch-px" label: "Smallest cell in a picture, in px" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "noise-px" label: "Standard deviation of an observation, in px" type: OPTION_TYPE_NUMBER is_rare: true }
)info",
    R"info(
name: "template build" title: "Build a template" verb: "Build" out: WORK_OUT_NAMED out_name: "template"
about: "A garment's mesh from a recording of it."
inputs { name: "sources" label: "Recording" item: ITEM_KIND_DUMP is_required: true may_repeat: true is_positional: true }
inputs { name: "rig" label: "Rig" item: ITEM_KIND_RIG }
inputs { name: "board" label: "Board" item: ITEM_KIND_BOARD is_required: true }
inputs { name: "panels" label: "Panels, if there are several" }
options { name: "openings" label: "Openings of the garment; −1: do not check" type: OPTION_TYPE_INTEGER least: -1 most: 100 }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "mosaic" label: "Mosaic of grey images, “bayer_rg8”" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "samples" label: "Frames to build from" type: OPTION_TYPE_INTEGER least: 1 most: 1000 is_rare: true }
options { name: "cell-mm" label: "Size of a printed cell, in mm; 0: as the board says" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "max-seam-gap-mm" label: "Widest seam, in mm; 0: four cells" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "max-hole-mm" label: "Longest border of a hole that is closed, in mm" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "allow-open-seams" label: "Wider seams stay open" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "corners" label: "A vertex at every corner of cells, too" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "set" label: "An option of a stage, NAME=VALUE" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "id" label: "Name of the template" type: OPTION_TYPE_TEXT is_rare: true }
)info",
    R"info(
name: "evaluate" title: "Evaluate a registration" verb: "Evaluate" out: WORK_OUT_NAMED out_name: "evaluation"
about: "Drift, distortion and other measures of a job's meshes, or two jobs compared." reads_besides: true
inputs { name: "result" label: "Job (job:ID)" is_required: true is_positional: true
}
inputs { name: "against" label: "Compare with the job (job:ID), if with any" }
inputs { name: "truth" label: "Ground truth, if there is any" }
inputs { name: "take" label: "Recording; empty: the job's" item: ITEM_KIND_DUMP }
inputs { name: "rig" label: "Rig; empty: the job's" item: ITEM_KIND_RIG }
inputs { name: "template" label: "Template; empty: the job's" item: ITEM_KIND_TEMPLATE }
inputs { name: "against-rig" label: "Rig of the other job; empty: its own" item: ITEM_KIND_RIG }
inputs { name: "against-template" label: "Template of the other job; empty: its own" item: ITEM_KIND_TEMPLATE }
options { name: "quick" label: "Quick: without distortion and texture drift" type: OPTION_TYPE_FLAG }
options { name: "no-truth" label: "Leave a truth beside the take alone" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "fps" label: "Frames per second; empty: those of the take" type: OPTION_TYPE_NUMBER is_rare: true }
options { name: "samples" label: "Frames that are measured; 0: all" type: OPTION_TYPE_INTEGER is_rare: true }
options { name: "sources" label: "Vertices that distances are measured from" type: OPTION_TYPE_INTEGER least: 1 most: 100000 is_rare: true }
options { name: "seed" label: "Seed of the choice of those vertices" type: OPTION_TYPE_INTEGER is_rare: true }
)info",
    R"info(
name: "export" title: "Export meshes" verb: "Export" out: WORK_OUT_NAMED out_name: "export"
about: "A job's meshes as files of other programs." reads_besides: true
inputs { name: "result" label: "Job (job:ID)" is_required: true is_positional: true
}
inputs { name: "take" label: "Recording; empty: the job's" item: ITEM_KIND_DUMP }
inputs { name: "rig" label: "Rig; empty: the job's" item: ITEM_KIND_RIG }
options { name: "format" label: "Format" type: OPTION_TYPE_TEXT preset: "glb" is_required: true
  choices: "glb" choices: "ply" choices: "obj" choices: "usda" choices: "mdd" choices: "pc2" choices: "npz"
  choices: "jpg" choices: "png" choices: "mp4" choices: "mkv" }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "fps" label: "Frames per second" type: OPTION_TYPE_NUMBER }
options { name: "overlay" label: "Draw over the pictures (jpg, png, mp4)" type: OPTION_TYPE_TEXT
  choices: "wireframe" choices: "state" choices: "sigma" choices: "none" }
options { name: "camera" label: "Camera of the overlay" type: OPTION_TYPE_TEXT }
options { name: "texture" label: "Size of the texture, in px" type: OPTION_TYPE_INTEGER }
options { name: "meshopt" label: "Compressed (glb)" type: OPTION_TYPE_FLAG }
options { name: "allow-unfinished" label: "Although frames are missing" type: OPTION_TYPE_FLAG }
options { name: "up" label: "Axis that points up" type: OPTION_TYPE_TEXT choices: "y" choices: "z" is_rare: true }
options { name: "world-up" label: "Axis of the rig's world that points up" type: OPTION_TYPE_TEXT
  choices: "x" choices: "-x" choices: "y" choices: "-y" choices: "z" choices: "-z" is_rare: true }
options { name: "unit" label: "Unit of lengths" type: OPTION_TYPE_TEXT choices: "m" choices: "cm" choices: "mm" is_rare: true }
options { name: "attributes" label: "Attributes of vertices, “uv,state”" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "undistort" label: "Overlays without lens distortion" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "texture-frames" label: "Frames that the texture is the mean of" type: OPTION_TYPE_INTEGER is_rare: true }
options { name: "normal-map" label: "Size of the normal map, in px" type: OPTION_TYPE_INTEGER is_rare: true }
options { name: "max-vertices" label: "A coarser mesh of at most so many vertices; 0: all" type: OPTION_TYPE_INTEGER is_rare: true }
)info",
    R"info(
name: "take verify" title: "Check a take's bytes" verb: "Check" out: WORK_OUT_NONE
about: "Whether all that was recorded can be read."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true
}
)info",
    R"info(
name: "take info" title: "Describe a take" verb: "Describe" out: WORK_OUT_NONE
about: "What a take holds."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true
}
)info",
    R"info(
name: "take trim" title: "Trim a take" verb: "Trim" out: WORK_OUT_TAKE
about: "Some frames of a take as a take of their own."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true
}
options { name: "frames" label: "Frames that stay, “0003:0010”" type: OPTION_TYPE_TEXT }
options { name: "shift" label: "A camera whose times move, CAMERA=MILLISECONDS" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "compress" label: "Compressed" type: OPTION_TYPE_FLAG is_rare: true }
)info",
    R"info(
name: "take export" title: "Export a take's images" verb: "Export" out: WORK_OUT_NAMED out_name: "images"
about: "A take as images, or as films of its cameras."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true
}
options { name: "format" label: "Format" type: OPTION_TYPE_TEXT preset: "images" choices: "images" choices: "ffv1" choices: "proxy" }
options { name: "camera-width-px" label: "Width of a camera in a film, in px" type: OPTION_TYPE_INTEGER is_rare: true }
options { name: "demosaic" label: "Colour images instead of mosaics" type: OPTION_TYPE_FLAG is_rare: true }
)info"};

}  // namespace weft
