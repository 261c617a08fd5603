#pragma once

// Vectors of OGRE by their header of 1.10 and later, or of 1.9: the old name warns in the new ones.
#if __has_include(<OgreVector.h>)
#include <OgreVector.h>
#else
#include <OgreVector3.h>
#endif
