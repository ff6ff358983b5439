package com.kuka.math.geometry;

/** Something with a translation and a rotation. */
public interface ITransformation {
}
