"""Pictures of an RGB-D camera: conversion, rectification, registration, masks, coarse grid."""
