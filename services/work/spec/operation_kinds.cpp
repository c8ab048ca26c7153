// Operations: commands of `weft` that a daemon runs for its clients. No option of theirs names a file.
#include "services/work/spec/kind_texts.h"

namespace weft {

const char* const kOperationKinds[9] = {
    R"info(
name: "rig calibrate" title: "Calibrate a rig" verb: "Calibrate" out: WORK_OUT_NAMED out_name: "rig.json"
about: "Cameras from a recording of a target."
inputs { name: "dump" label: "Recording of the target, a take or a folder of images" item: ITEM_KIND_DUMP is_required: true is_positional: true }
inputs { name: "target" label: "Target, target.json" is_required: true }
inputs { name: "rig" label: "Earlier rig whose lenses are the start, if any" item: ITEM_KIND_RIG }
options { name: "every" label: "Look at one frame in so many" type: OPTION_TYPE_INTEGER least: 1 most: 10000 }
options { name: "min-views" label: "Views of boards that every camera needs" type: OPTION_TYPE_INTEGER least: 3 most: 10000 }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "id" label: "Name of the rig, kept in the file" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "mosaic" label: "Mosaic of grey images, “bayer_rg8”" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-frame" label: "Frame whose board is the world, x along its columns, y down its rows; empty: the board that most cameras saw" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-board" label: "Which of the boards" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "world-floor" label: "That board lies on the floor, face up: y points into the floor" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "scale" label: "Metric scale from the size of the tags or from the scale bars" type: OPTION_TYPE_TEXT choices: "tags" choices: "bar" is_rare: true }
options { name: "gamma" label: "Gamma of the images: 1 of linear cameras, 2.2 of JPEG and sRGB" type: OPTION_TYPE_NUMBER least: 0.3 most: 4 is_rare: true }
options { name: "max-blur-px" label: "Tags with softer edges are refused, in px" type: OPTION_TYPE_NUMBER least: 1e-300 most: inf is_rare: true }
options { name: "max-rms-px" label: "Reprojection error that is accepted of a camera, in px" type: OPTION_TYPE_NUMBER least: 1e-300 most: inf is_rare: true }
options { name: "max-stage-sigma-px" label: "How uncertain a camera may be about known points of the stage, in px" type: OPTION_TYPE_NUMBER least: 1e-300 most: inf is_rare: true }
)info",
    R"info(
name: "rig plan" title: "Plan a rig" verb: "Plan" out: WORK_OUT_NAMED out_name: "plan"
about: "Which cameras see a garment, before they are bought."
inputs { name: "rig" label: "Cameras to choose from" item: ITEM_KIND_RIG is_required: true }
inputs { name: "template" label: "Template" item: ITEM_KIND_TEMPLATE is_required: true }
inputs { name: "motion" label: "How it moves: a mesh.ply, a folder of <frame>/mesh.ply, a job (job:ID); empty: as the template" }
options { name: "cameras" label: "Cameras to choose; 0: as few as come within 1 % of what all cover" type: OPTION_TYPE_INTEGER most: inf }
options { name: "views" label: "Cameras that must see a cell" type: OPTION_TYPE_INTEGER least: 2 most: 100 }
options { name: "moments" label: "Frames of the motion, spread evenly; 0: all" type: OPTION_TYPE_INTEGER most: inf }
options { name: "max-facing-deg" label: "A cell is seen within this angle, in degrees" type: OPTION_TYPE_NUMBER least: 1 most: 89 is_rare: true }
options { name: "min-pitch-px" label: "Smallest cell in a picture, in px" type: OPTION_TYPE_NUMBER most: inf is_rare: true }
options { name: "noise-px" label: "Standard deviation of an observation, for the expected sigma, in px" type: OPTION_TYPE_NUMBER least: 1e-300 most: inf is_rare: true }
)info",
    R"info(
name: "template build" title: "Build a template" verb: "Build" out: WORK_OUT_NAMED out_name: "template"
about: "A garment's mesh from a recording of it."
inputs { name: "sources" label: "Recordings of the garment, or clouds of frames" item: ITEM_KIND_DUMP is_required: true may_repeat: true is_positional: true }
inputs { name: "rig" label: "Rig of the cameras that recorded it" item: ITEM_KIND_RIG }
inputs { name: "board" label: "Board of the cloth" item: ITEM_KIND_BOARD is_required: true }
inputs { name: "panels" label: "Image of the panels, a pixel per cell, black outside the garment; empty: the cells that are seen" }
options { name: "openings" label: "Openings of the garment, 4 of a T-shirt (neck, sleeves, hem), 2 of a skirt; -1: any" type: OPTION_TYPE_INTEGER least: -1 most: 100 }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "mosaic" label: "Mosaic of grey images, “bayer_rg8”" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "samples" label: "Frames to build from, spread evenly" type: OPTION_TYPE_INTEGER least: 1 most: 1000 is_rare: true }
options { name: "cell-mm" label: "Size of a printed cell, in mm; 0: as the board or the clouds say" type: OPTION_TYPE_NUMBER most: inf is_rare: true }
options { name: "max-seam-gap-mm" label: "Furthest that both sides of a seam may be apart, in mm; 0: four cells" type: OPTION_TYPE_NUMBER most: inf is_rare: true }
options { name: "max-hole-mm" label: "Longest border of a hole that is closed, in mm; 0: sixty cells" type: OPTION_TYPE_NUMBER most: inf is_rare: true }
options { name: "allow-open-seams" label: "Borders that run along each other like a seam but further apart stay open" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "corners" label: "A vertex at every corner of cells, too: twice as many, and registration takes twice as long" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "set" label: "An option of a stage, NAME=VALUE" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "id" label: "Name of the template; empty: that of the folder" type: OPTION_TYPE_TEXT is_rare: true }
)info",
    R"info(
name: "evaluate" title: "Evaluate a registration" verb: "Evaluate" out: WORK_OUT_NAMED out_name: "evaluation"
about: "Drift, distortion and other measures of a job's meshes, or two jobs compared." reads_besides: true
inputs { name: "result" label: "Result of a job, its folder or job:ID" is_required: true is_positional: true }
inputs { name: "against" label: "Another result of the same frames (job:ID): compare the two, with significance" }
inputs { name: "truth" label: "Ground truth, the folder truth of a synthetic take; empty: where the take has it" }
inputs { name: "take" label: "Recording; empty: the job's" item: ITEM_KIND_DUMP }
inputs { name: "rig" label: "Rig; empty: the job's" item: ITEM_KIND_RIG }
inputs { name: "template" label: "Template; empty: the job's" item: ITEM_KIND_TEMPLATE }
inputs { name: "against-rig" label: "Rig of the other job; empty: its own" item: ITEM_KIND_RIG }
inputs { name: "against-template" label: "Template of the other job; empty: its own" item: ITEM_KIND_TEMPLATE }
options { name: "quick" label: "Leave out geodesic distortion and texture drift, which take long" type: OPTION_TYPE_FLAG }
options { name: "no-truth" label: "Leave a truth beside the take alone" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "fps" label: "Frames per second, for drift; empty: by the times of the take" type: OPTION_TYPE_NUMBER least: 1e-300 most: inf is_rare: true }
options { name: "samples" label: "Frames at which distortion and texture drift are measured, spread evenly; 0: all" type: OPTION_TYPE_INTEGER most: inf is_rare: true }
options { name: "sources" label: "Vertices that geodesic distances are measured from" type: OPTION_TYPE_INTEGER least: 1 most: 100000 is_rare: true }
options { name: "seed" label: "Seed of the choice of those vertices" type: OPTION_TYPE_INTEGER is_rare: true }
)info",
    R"info(
name: "export" title: "Export meshes" verb: "Export" out: WORK_OUT_NAMED out_name: "export"
about: "A job's meshes as files of other programs." reads_besides: true
inputs { name: "result" label: "Result of a job, its folder or job:ID" is_required: true is_positional: true }
inputs { name: "take" label: "Recording; empty: the job's" item: ITEM_KIND_DUMP }
inputs { name: "rig" label: "Rig; empty: the job's" item: ITEM_KIND_RIG }
options { name: "format" label: "Format" type: OPTION_TYPE_TEXT preset: "glb" is_required: true
  choices: "glb" choices: "ply" choices: "obj" choices: "usda" choices: "mdd" choices: "pc2" choices: "npz"
  choices: "jpg" choices: "png" choices: "mp4" choices: "mkv" }
options { name: "frames" label: "Frames, “0003:0010”; empty: all" type: OPTION_TYPE_TEXT }
options { name: "fps" label: "Frames per second, for times and velocities; 0: by the times of the take" type: OPTION_TYPE_NUMBER most: inf }
options { name: "overlay" label: "Draw the mesh over the pictures (jpg, png, mp4, mkv), its edges, or faces by state or sigma; none: pictures alone" type: OPTION_TYPE_TEXT
  choices: "wireframe" choices: "state" choices: "sigma" choices: "none" }
options { name: "camera" label: "Cameras of overlays and textures; empty: all" type: OPTION_TYPE_TEXT }
options { name: "texture" label: "Size of the texture from all cameras (png: of each frame, glb: one for all), in px; 0: none" type: OPTION_TYPE_INTEGER most: 16384 }
options { name: "meshopt" label: "Compressed for browsers (glb), rounded to 0.008 mm; Blender does not read it" type: OPTION_TYPE_FLAG }
options { name: "allow-unfinished" label: "Export what is there of a job that has not ended" type: OPTION_TYPE_FLAG }
options { name: "up" label: "Axis that points up; empty: that of the format" type: OPTION_TYPE_TEXT choices: "y" choices: "z" is_rare: true }
options { name: "world-up" label: "Axis of the rig's world that points up, -y where the world lies on the floor" type: OPTION_TYPE_TEXT
  choices: "x" choices: "-x" choices: "y" choices: "-y" choices: "z" choices: "-z" is_rare: true }
options { name: "unit" label: "Unit of lengths" type: OPTION_TYPE_TEXT choices: "m" choices: "cm" choices: "mm" is_rare: true }
options { name: "attributes" label: "Attributes of vertices, “uv,state”, or none; empty: all of the format but normal" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "undistort" label: "Overlays without lens distortion, with their rig.json: backgrounds for Blender and others" type: OPTION_TYPE_FLAG is_rare: true }
options { name: "texture-frames" label: "Frames that the texture of a glb is the mean of" type: OPTION_TYPE_INTEGER least: 1 most: inf is_rare: true }
options { name: "normal-map" label: "Size of the normal maps for the mesh of max-vertices (png, or glb of one frame), in px; 0: none" type: OPTION_TYPE_INTEGER most: 16384 is_rare: true }
options { name: "mesh" label: "Which of the frames' meshes; empty: the garment, or the only one" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "max-vertices" label: "A coarser mesh of at most so many vertices, the same in all exports of a job; 0: all" type: OPTION_TYPE_INTEGER most: inf is_rare: true }
)info",
    R"info(
name: "take verify" title: "Check a take's bytes" verb: "Check" out: WORK_OUT_NONE
about: "Whether all that was recorded can be read."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true }
)info",
    R"info(
name: "take info" title: "Describe a take" verb: "Describe" out: WORK_OUT_NONE
about: "What a take holds."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true }
)info",
    R"info(
name: "take trim" title: "Trim a take" verb: "Trim" out: WORK_OUT_TAKE
about: "Some frames of a take as a take of their own."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true }
options { name: "frames" label: "Frames that stay, “0003:0010”" type: OPTION_TYPE_TEXT }
options { name: "shift" label: "A camera whose times move, CAMERA=MILLISECONDS" type: OPTION_TYPE_TEXT is_rare: true }
options { name: "compress" label: "Planes apart, predictor and zstd: lossless, half the size, a core's work" type: OPTION_TYPE_FLAG is_rare: true }
)info",
    R"info(
name: "take export" title: "Export a take's images" verb: "Export" out: WORK_OUT_NAMED out_name: "images"
about: "A take as images, or as films of its cameras."
inputs { name: "take" label: "Take (take:ID)" item: ITEM_KIND_DUMP is_required: true is_positional: true }
options { name: "format" label: "Format" type: OPTION_TYPE_TEXT preset: "images" choices: "images" choices: "ffv1" choices: "proxy" }
options { name: "camera-width-px" label: "Width of a camera in a proxy, in px; 0: all cameras within 1920 px" type: OPTION_TYPE_INTEGER most: 8192 is_rare: true }
options { name: "demosaic" label: "Colour images instead of Bayer mosaics" type: OPTION_TYPE_FLAG is_rare: true }
)info"};

}  // namespace weft
