package com.kuka.common.concurrent;

/** Only imports are known; it has no members. */
public interface IWaitToken {
}
