// Ids, aliases and references of a scene.
#pragma once
#include "runtime/scene/xml/document.h"

namespace itn {

// Fills by_id and names the objects without an id. Throws InputError with every id that is taken twice, every
// reference to nothing, and circles of references: afterwards all references lead somewhere, at most 64 deep.
void resolve_references(Document& document, Report& report);

}  // namespace itn
