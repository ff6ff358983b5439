package com.kuka.generated.flexfellow;

/** A mobile cabinet of some projects. Only imports are known; it has no members. */
public interface FlexFellow {
}
