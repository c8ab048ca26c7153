#include "services/work/spec/kind_texts.h"

namespace weft {

const char* const kJobKinds[2] = {
    R"info(
name: "register" title: "Register a take" verb: "Register" done_word: "registered"
about: "From the images of a take to registered meshes."
start: WORK_START_JOB_FIELDS out: WORK_OUT_NAMED
inputs { name: "rig" label: "the rig" item: ITEM_KIND_RIG is_required: true field: "rig" }
inputs { name: "board" label: "the board" item: ITEM_KIND_BOARD is_required: true field: "board" }
inputs { name: "template" label: "the template" item: ITEM_KIND_TEMPLATE is_required: true field: "garment" }
inputs { name: "scans" label: "the scans" field: "options.scans" }
inputs { name: "start-from" label: "the starts" field: "options.starts" }
inputs { name: "dump" label: "the take" item: ITEM_KIND_DUMP is_required: true is_positional: true field: "dump" }
)info",
    R"info(
name: "drive" title: "Drive an avatar" verb: "Drive" done_word: "driven"
about: "A garment's avatar is moved by the images of few cameras."
start: WORK_START_JOB_FIELDS out: WORK_OUT_NAMED
inputs { name: "rig" label: "the rig" item: ITEM_KIND_RIG is_required: true field: "rig" }
inputs { name: "board" label: "the board" item: ITEM_KIND_BOARD is_required: true field: "board" }
inputs { name: "template" label: "the template" item: ITEM_KIND_TEMPLATE is_required: true field: "garment" }
inputs { name: "avatar" label: "the avatar" item: ITEM_KIND_AVATAR is_required: true field: "driving.avatar" }
inputs { name: "scans" label: "the scans" field: "options.scans" }
inputs { name: "start-from" label: "the starts" field: "options.starts" }
inputs { name: "dump" label: "the take" item: ITEM_KIND_DUMP is_required: true is_positional: true field: "dump" }
)info"};

}  // namespace weft
