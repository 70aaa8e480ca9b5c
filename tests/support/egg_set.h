// A data set of one shape, an egg of 2 mm under two suns, of which nothing has been rendered.
#pragma once
#include "network/dataset/manifest.h"
#include "tests/support/temporary_folder.h"

struct EggSet {
  TemporaryFolder folder;  // with its mesh
  itn::Manifest set;       // 16 x 16 pixels, no images

  EggSet();
};
