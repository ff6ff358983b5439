package com.kuka.generated.flexfellow;

/** A mobile cabinet that some projects have; only imports of it are known, there is nothing to call. */
public interface FlexFellow {
}
