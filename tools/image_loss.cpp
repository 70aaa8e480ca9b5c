#include "tools/image_loss.h"

#include "runtime/error.h"

namespace itn::tools {

RenderedImageLoss make_image_loss(const std::string& kind, const CommonOptions&, const std::string&, const Manifest&,
                                  const DatasetImages&) {
  throw UsageError("--network " + kind + ": its image loss is not there yet; train rn");
}

}  // namespace itn::tools
